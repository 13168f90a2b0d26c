// The error budget of docs/theory.md: what each step from a mesh to a delivered file costs, by the resolution N, and at which power
// of N it falls. Prints tables in Markdown.
//
//   error_budget            the figures of docs/theory.md; some minutes
//   error_budget --quick    coarse, and exit code 1 if an error falls more slowly than it has to

#include <Eigen/Geometry>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "rayrep/base/error.h"
#include "rayrep/io/mesh_io.h"
#include "rayrep/make/cavity.h"
#include "rayrep/make/hollow.h"
#include "rayrep/rays/inner_domain.h"
#include "rayrep/rays/ray_integrals.h"

namespace {

using namespace rayrep;
using Eigen::Vector3d;

Mesh example(const std::string& name) {
  return read_mesh(std::filesystem::path(RAYREP_SOURCE_DIR) / "examples" / (name + ".stl")).mesh;
}

/// The power of N by which the errors fall: the slope of the straight line through them, both logarithmic.
double slope(const std::vector<int>& N, const std::vector<double>& errors) {
  double x = 0, y = 0, xx = 0, xy = 0;
  const auto n = static_cast<double>(N.size());
  for (std::size_t k = 0; k < N.size(); ++k) {
    const double a = std::log(N[k]);
    const double b = std::log(std::max(errors[k], 1e-300));
    x += a;
    y += b;
    xx += a * a;
    xy += a * b;
  }
  return (n * xy - x * y) / (n * xx - x * x);
}

struct Row {
  std::string what;
  std::vector<double> errors;
  std::optional<double> least_slope;  ///< negative; none: it need not fall
};

int print(const std::vector<int>& N, const std::vector<Row>& rows) {
  int slow = 0;
  std::printf("| error |");
  for (const int n : N) std::printf(" N = %d |", n);
  std::printf(" falls with N to the |\n|---|");
  for (std::size_t k = 0; k <= N.size(); ++k) std::printf("---|");
  std::printf("\n");
  for (const Row& row : rows) {
    std::printf("| %s |", row.what.c_str());
    for (const double e : row.errors) std::printf(" %.1e |", e);
    const double s = slope(N, row.errors);
    row.least_slope ? std::printf(" %.1f |\n", s) : std::printf(" - |\n");
    if (row.least_slope && !(s < *row.least_slope)) {
      std::fprintf(stderr, "%s falls with N^%.2f, and has to with N^%.2f at least\n", row.what.c_str(), s, *row.least_slope);
      ++slow;
    }
  }
  std::printf("\n");
  std::fflush(stdout);
  return slow;
}

/// A body in its working frame with a cavity above a quadric, on a grid of its own for each N.
struct Model {
  Mesh working;
  double size, wall;
  Moments q;
};

Model model(const std::string& name) {
  Model m;
  const Mesh mesh = example(name);
  m.working = transformed(mesh, working_frame(mesh, Vector3d::UnitZ()));
  const Eigen::AlignedBox3d box = bounding_box(m.working);
  m.size = box.sizes().maxCoeff();
  m.wall = 0.04 * m.size;
  // A bowl about a leaning axis: what spin makes, roughly. Material is below.
  m.q = Moments::Zero();
  m.q[M1] = -0.35 * box.sizes().z() / m.size;
  m.q[MZ] = 1 / m.size;
  m.q[MX] = 0.13 / m.size;
  m.q[MXX] = m.q[MYY] = -0.6 / (m.size * m.size);
  m.q[MZZ] = 0.2 / (m.size * m.size);
  return m;
}

struct Found {
  double ends, rays_volume, rays_height, mesh_volume, mesh_height;
};

/// What rays and mesh make of the cavity { p in the inner domain: q.phi > 0 } at this spacing.
Found found(const Model& m, int N) {
  const SurfaceQuery surface(m.working);
  const double h = m.size / N;
  InnerDomain domain = inner_domain(surface, {.wall_mm = m.wall, .ray_spacing_mm = h, .field_spacing_mm = h});
  Found f{};
  for (std::size_t ray = 0; ray < domain.rays.grid.size(); ++ray) {
    const Eigen::Vector2d xy = domain.rays.grid.at(ray);
    for (auto n = domain.rays.first[ray]; n < domain.rays.first[ray + 1]; ++n)
      for (const double z : {domain.rays.intervals[n].lo, domain.rays.intervals[n].hi})
        f.ends += std::abs(surface.closest({xy.x(), xy.y(), z}, 2 * m.wall).distance_mm - m.wall);
  }
  f.ends /= 2 * m.size * static_cast<double>(domain.rays.intervals.size());
  const RayIntegrals integrals(domain.rays);
  const Moments rays = integrals.full() - integrals.moments(m.q);
  f.rays_volume = rays[M1];
  f.rays_height = rays[MZ];
  const Moments mesh =
      mesh_moments(mesh_cavity(domain.field, surface, m.q, {.wall_mm = m.wall, .min_cavity_mm3 = 0, .as_delivered = {}}).mesh);
  f.mesh_volume = -mesh[M1];
  f.mesh_height = -mesh[MZ];
  return f;
}

int domain_rays_meshing(const std::string& name, const std::vector<int>& N, int finest) {
  const Model m = model(name);
  // The finest mesh stands for the truth: its corners lie on the surfaces themselves.
  const Found truth = found(m, finest);
  const double V = mesh_moments(m.working)[M1];
  std::vector<double> ends, rays, rays_z, meshes, meshes_z;
  for (const int n : N) {
    const Found f = found(m, n);
    ends.push_back(f.ends);
    rays.push_back(std::abs(f.rays_volume - truth.mesh_volume) / V);
    rays_z.push_back(std::abs(f.rays_height - truth.mesh_height) / (V * m.size));
    meshes.push_back(std::abs(f.mesh_volume - truth.mesh_volume) / V);
    meshes_z.push_back(std::abs(f.mesh_height - truth.mesh_height) / (V * m.size));
  }
  std::printf("%s, wall %.1f mm, against the mesh at N = %d\n\n", name.c_str(), m.wall, finest);
  return print(N, {{"domain: ends of rays off the offset surface, mean, over the size", ends, -1.5},
                   {"rays: volume of the cavity, over that of the solid", rays, -1.2},
                   {"rays: its static moment", rays_z, -1.2},
                   {"meshing: volume", meshes, -1.5},
                   {"meshing: static moment", meshes_z, -1.5}});
}

Spec spinning() { return SpinSpec{}; }

double mass_g(const Mesh& mesh) { return mass_properties(mesh, 1.24).mass_g; }

/// Of a whole run: the objective and the mass against those of the finest rays, what the loop leaves, and what files do to it. The
/// cavity's grid is never coarser than half the wall: below some N these do not fall.
int whole(const std::string& name, const Spec& spec, const std::vector<int>& N, int finest) {
  const Mesh solid = example(name);
  const auto at = [&](int n) {
    HollowOptions options;
    options.resolution = n;
    return hollow(solid, spec, options);
  };
  const HollowResult truth = at(finest);
  const double best = mass_g(truth.delivery.body());
  std::vector<double> masses, objectives, left;
  for (const int n : N) {
    const HollowResult result = at(n);
    masses.push_back(std::abs(mass_g(result.delivery.body()) / best - 1));
    objectives.push_back(std::abs(result.solve.objective / truth.solve.objective - 1));
    left.push_back(result.as_built_error);
  }
  std::printf("spin %s.stl, against N = %d\n\n", name.c_str(), finest);
  const int slow = print(N, {{"objective of the model, relative", objectives, {}},
                             {"mass of the delivered mesh, relative", masses, {}},
                             {"as built: offset and products of inertia that the loop leaves", left, {}}});
  const Mesh& body = truth.delivery.body();
  std::printf("| file | mass, relative | centre of mass, over the diagonal |\n|---|---|---|\n");
  const MassProperties exact = mass_properties(body, 1.24);
  for (const char* file : {"x.stl", "x.obj", "x.ply", "x.3mf"}) {
    const MassProperties stored = mass_properties(as_stored(file, body), 1.24);
    std::printf("| %s | %.1e | %.1e |\n", file + 2, std::abs(stored.mass_g / exact.mass_g - 1),
                (stored.centre_of_mass_mm - exact.centre_of_mass_mm).norm() / bounding_box(body).diagonal().norm());
  }
  std::printf("\n");
  return slow;
}

/// The same shape in another place: rays and grid stand elsewhere in it.
void frames(const std::string& name, const std::vector<int>& N) {
  const Mesh solid = example(name);
  const auto mass = [&](const Mesh& mesh, int n, double s) {
    HollowOptions options;
    options.resolution = n;
    options.min_cavity_mm3 *= s * s * s;
    SpinSpec spec;
    spec.print.wall_mm *= s;
    return mass_g(hollow(mesh, spec, options).delivery.body()) / (s * s * s);
  };
  struct Motion {
    const char* what;
    Eigen::Affine3d motion;
    double scale = 1;
    bool mirrored = false;
  };
  const auto about_z = [](double degrees) {
    return Eigen::Affine3d(Eigen::AngleAxisd(degrees * EIGEN_PI / 180, Vector3d::UnitZ()));
  };
  const std::vector<Motion> motions = {{"turned by 90 degrees about up", about_z(90)},
                                       {"turned by 17 degrees about up", about_z(17)},
                                       {"mirrored across x", Eigen::Affine3d(Eigen::Scaling(-1.0, 1.0, 1.0)), 1, true},
                                       {"moved", Eigen::Affine3d(Eigen::Translation3d(13.7, -5.1, 3.3))},
                                       {"scaled by 2, with the wall", Eigen::Affine3d(Eigen::Scaling(2.0)), 2},
                                       {"scaled by 3.7, with the wall", Eigen::Affine3d(Eigen::Scaling(3.7)), 3.7}};
  std::printf("spin %s.stl: change of the mass, relative\n\n| the same shape |", name.c_str());
  for (const int n : N) std::printf(" N = %d |", n);
  std::printf("\n|---|");
  for (std::size_t k = 0; k < N.size(); ++k) std::printf("---|");
  std::printf("\n");
  std::vector<double> before;
  for (const int n : N) before.push_back(mass(solid, n, 1));
  for (const Motion& motion : motions) {
    Mesh mesh = solid;
    for (Vector3d& v : mesh.vertices) v = motion.motion * v;
    if (motion.mirrored) flip(mesh);
    std::printf("| %s |", motion.what);
    for (std::size_t k = 0; k < N.size(); ++k) std::printf(" %.1e |", std::abs(mass(mesh, N[k], motion.scale) / before[k] - 1));
    std::printf("\n");
    std::fflush(stdout);
  }
  std::printf("\n");
}

}  // namespace

int main(int count, char** arguments) {
  const bool quick = count > 1 && std::strcmp(arguments[1], "--quick") == 0;
  try {
    int slow = 0;
    if (quick) {
      slow += domain_rays_meshing("tilted_ellipsoid", {20, 40, 80}, 160);
      slow += whole("tilted_ellipsoid", spinning(), {20, 40, 80}, 160);
      return slow > 0;
    }
    for (const char* name : {"tilted_ellipsoid", "duck"}) slow += domain_rays_meshing(name, {40, 80, 160, 320}, 480);
    for (const char* name : {"tilted_ellipsoid", "bird"}) slow += whole(name, spinning(), {40, 80, 160, 320}, 480);
    frames("bird", {50, 100, 200});
    return slow > 0;
  } catch (const Error& error) {
    std::fprintf(stderr, "error_budget: %s\n", error.what());
    return 2;
  }
}
