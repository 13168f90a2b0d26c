#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <limits>

#include "bindings.h"

namespace py = pybind11;

namespace rayrep::python {
namespace {

static_assert(sizeof(Eigen::Vector3d) == 3 * sizeof(double) && sizeof(Eigen::Vector3i) == 3 * sizeof(int), "arrays are views");

[[noreturn]] void usage_error(const std::string& message) { throw Error(ErrorCode::usage, message); }

std::string shape_of(const py::array& array) {
  std::string text = "(";
  for (py::ssize_t n = 0; n < array.ndim(); ++n) text += (n ? ", " : "") + std::to_string(array.shape(n));
  return text + (array.ndim() == 1 ? ",)" : ")");
}

/// Whatever becomes an array of rows of three numbers of one of these kinds (numpy.dtype.kind). Nothing becomes no rows.
py::array rows_of_three(const py::object& given, const char* name, const std::string& kinds) {
  const py::array array = py::array::ensure(given);
  if (!array) {
    PyErr_Clear();
    usage_error(std::string(name) + " must be an array of shape (n, 3).");
  }
  if (array.size() == 0 && (array.ndim() == 1 || (array.ndim() == 2 && array.shape(1) == 3)))
    return array_of(std::vector<Eigen::Vector3d>{});
  if (array.ndim() != 2 || array.shape(1) != 3)
    usage_error(std::string(name) + " must have the shape (n, 3); it is " + shape_of(array) + "." +
                (array.ndim() == 2 && array.shape(1) == 4 && name[0] == 'f' ? " Split quads into triangles first." : ""));
  if (kinds.find(array.dtype().kind()) == std::string::npos)
    usage_error(std::string(name) + " must hold " + (name[0] == 'f' ? "whole numbers" : "real numbers") + "; its dtype is " +
                std::string(py::str(array.dtype())) + ".");
  return array;
}

std::vector<Eigen::Vector3d> vertices_of(const py::object& given) {
  const py::array_t<double, py::array::c_style | py::array::forcecast> rows(rows_of_three(given, "vertices", "fiu"));
  std::vector<Eigen::Vector3d> vertices(static_cast<std::size_t>(rows.shape(0)));
  for (std::size_t n = 0; n < vertices.size(); ++n) {
    vertices[n] = Eigen::Map<const Eigen::Vector3d>(rows.data() + 3 * n);
    if (!vertices[n].allFinite()) usage_error("vertices must be finite; vertex " + std::to_string(n) + " is not.");
  }
  return vertices;
}

/// Indices are compared as 64 bits, signed or not, so that none that is too large seems to fit.
template <typename Integer>
std::vector<Eigen::Vector3i> faces_below(const py::array& given, std::size_t vertices) {
  const py::array_t<Integer, py::array::c_style | py::array::forcecast> rows(given);
  std::vector<Eigen::Vector3i> faces(static_cast<std::size_t>(rows.shape(0)));
  const Integer* at = rows.data();
  for (std::size_t n = 0; n < faces.size(); ++n)
    for (int k = 0; k < 3; ++k, ++at) {
      if (*at < 0 || static_cast<std::uint64_t>(*at) >= vertices)
        usage_error("faces must be indices of vertices, 0 to " + std::to_string(static_cast<std::int64_t>(vertices) - 1) +
                    "; face " + std::to_string(n) + " has " + std::to_string(*at) + ".");
      faces[n][k] = static_cast<int>(*at);
    }
  return faces;
}

std::vector<Eigen::Vector3i> faces_of(const py::object& given, std::size_t vertices) {
  if (vertices > static_cast<std::size_t>(std::numeric_limits<int>::max())) usage_error("There are more vertices than 2^31 - 1.");
  const py::array rows = rows_of_three(given, "faces", "iu");
  return rows.dtype().kind() == 'u' ? faces_below<std::uint64_t>(rows, vertices) : faces_below<std::int64_t>(rows, vertices);
}

Body body_of(const py::object& vertices, const py::object& faces) {
  Body body;
  body.mesh.vertices = vertices_of(vertices);
  body.mesh.triangles = faces_of(faces, body.mesh.vertices.size());
  return body;
}

/// A view that cannot be written through and keeps its owner alive.
template <typename Scalar, typename Row>
py::array view_of(const std::vector<Row>& rows, const py::object& owner) {
  py::array_t<Scalar> view({static_cast<py::ssize_t>(rows.size()), py::ssize_t{3}}, reinterpret_cast<const Scalar*>(rows.data()),
                           owner);
  py::detail::array_proxy(view.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  return view;
}

const Mesh& mesh_of(const py::object& self) { return self.cast<const Body&>().mesh; }

MassProperties mass_of(const Body& body) { return mass_properties(body.mesh, 1e3); }  // g/cm3: 1 g per mm3

bool is_watertight(const Body& body) {
  if (body.mesh.triangles.empty()) return false;
  const MeshReport report = check_mesh(body.mesh, {.self_intersections = false, .first_aid = false}).report;
  return report.unbalanced_edges.count == 0 && report.not_finite.count == 0;
}

py::object bounds(const Body& body) {
  const Eigen::AlignedBox3d box = bounding_box(body.mesh);
  if (box.isEmpty()) return py::none();
  return array_of(std::vector<Eigen::Vector3d>{box.min(), box.max()});
}

py::object extents(const Body& body) {
  const Eigen::AlignedBox3d box = bounding_box(body.mesh);
  if (box.isEmpty()) return py::none();
  return array_of(Eigen::Vector3d(box.sizes()));
}

double volume(const Body& body) { return mesh_moments(body.mesh)[M1]; }

std::vector<Body> split(const Body& body) {
  std::vector<Body> bodies;
  for (Mesh& mesh : rayrep::split(body.mesh, bodies_of(body.mesh))) bodies.push_back({std::move(mesh), body.name});
  return bodies;
}

/// "30 x 20 x 10 mm"
std::string sides(const Body& body) {
  const Eigen::Vector3d size = bounding_box(body.mesh).sizes();
  std::string text;
  for (int k = 0; k < 3; ++k) text += (k ? " x " : "") + py::str("{:.4g}").format(size[k]).cast<std::string>();
  return text + " mm";
}

/// Names of files need not be UTF-8.
py::str name(const Body& body) {
  return py::reinterpret_steal<py::str>(
      PyUnicode_DecodeFSDefaultAndSize(body.name.data(), static_cast<py::ssize_t>(body.name.size())));
}

std::string repr(const Body& body) {
  return "<rayrep.Mesh: " + std::to_string(body.mesh.vertices.size()) + " vertices, " + std::to_string(body.mesh.triangles.size()) +
         " faces" + (body.mesh.vertices.empty() ? "" : ", " + sides(body)) + ">";
}

constexpr const char* kAbout = R"(A surface of triangles, in mm. It cannot be changed: `vertices` and `faces` are views.

Parameters
----------
vertices : array of shape (n, 3)
    mm; copied.
faces : array of shape (m, 3)
    Indices of vertices from 0, counter-clockwise seen from outside the material; copied.

Raises
------
UsageError
    for arrays of another shape or kind, vertices that are not finite, indices without a vertex.

>>> import rayrep
>>> tetrahedron = rayrep.Mesh([[0, 0, 0], [3, 0, 0], [0, 3, 0], [0, 0, 3]],
...                           [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
>>> tetrahedron.volume
4.5)";

}  // namespace

py::str str_of(const std::string& text) {
  return py::reinterpret_steal<py::str>(PyUnicode_DecodeUTF8(text.data(), static_cast<py::ssize_t>(text.size()), "replace"));
}

std::vector<py::str> strs_of(const std::vector<std::string>& texts) {
  std::vector<py::str> strs;
  for (const std::string& text : texts) strs.push_back(str_of(text));
  return strs;
}

void bind_mesh(py::module_& module) {
  py::options options;
  options.disable_function_signatures();  // the stub has them
  py::class_<Body> mesh(module, "Mesh", kAbout);
  mesh.def(py::init(&body_of), py::arg("vertices"), py::arg("faces"));
  mesh.def_property_readonly(
      "vertices", [](const py::object& self) { return view_of<double>(mesh_of(self).vertices, self); },
      "Corners, mm: a read-only view of shape (n, 3), float64, valid as long as it is held.");
  mesh.def_property_readonly(
      "faces", [](const py::object& self) { return view_of<int>(mesh_of(self).triangles, self); },
      "Indices of the corners of each triangle: a read-only view of shape (m, 3), int32.");
  mesh.def_property_readonly("name", &name, "The path it was read from; empty for one made of arrays.");
  mesh.def_property_readonly("volume", &volume,
                             "Volume enclosed, mm^3: the sum of a . (b x c) / 6 over the triangles. Negative where they face "
                             "inward; what overlaps counts twice (mass_properties() counts it once).");
  mesh.def_property_readonly(
      "center_mass", [](const Body& body) { return array_of(mass_of(body).centre_of_mass_mm); },
      "Centroid of what is enclosed, mm, shape (3,). Raises InputError without a positive volume.");
  mesh.def_property_readonly(
      "moment_inertia", [](const Body& body) { return array_of(mass_of(body).inertia_g_mm2); },
      "Inertia tensor about center_mass at unit density, mm^5, shape (3, 3): the integral of |p|^2 1 - p p^T. "
      "Raises InputError without a positive volume.");
  mesh.def_property_readonly(
      "area", [](const Body& body) { return surface_area(body.mesh); }, "Area of all triangles, mm^2.");
  mesh.def_property_readonly("bounds", &bounds, "Lowest and highest corner of the bounding box, mm, shape (2, 3); None if empty.");
  mesh.def_property_readonly("extents", &extents, "Sides of the bounding box, mm, shape (3,); None if empty.");
  mesh.def_property_readonly("is_watertight", &is_watertight,
                             "Every edge is run equally often both ways, corners with equal coordinates being one.");
  mesh.def("split", &split, py::call_guard<py::gil_scoped_release>(),
           "The bodies that do not touch each other, as meshes. What crosses, touches or lies within another is one body.");
  mesh.def(
      "export", [](const Body& body, const std::filesystem::path& path) { write_mesh(path, body.mesh); }, py::arg("path"),
      py::call_guard<py::gil_scoped_release>(),
      "Writes .stl (binary, float32), .obj, .ply or .3mf by the ending of `path`, all of the file or nothing.\n\n"
      "Raises UsageError for another ending, WriteError where it cannot be written.");
  mesh.def("__repr__", &repr);
  mesh.def(py::pickle([](const py::object& self) { return py::make_tuple(self.attr("vertices"), self.attr("faces")); },
                      [](const py::tuple& arrays) {
                        if (arrays.size() != 2) usage_error("This is no pickle of a mesh.");
                        return body_of(arrays[0], arrays[1]);
                      }));
}

}  // namespace rayrep::python
