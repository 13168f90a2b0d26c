// Bodies with cavities that do what is wanted of them, then spoiled: whatever the judge accepts must stand up to a second opinion.
// Nothing may make it crash or throw anything but Error.

#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <variant>

#include "bodies.h"
#include "plain.h"
#include "rayrep/base/error.h"
#include "rayrep/judge/verify.h"
#include "second_opinion.h"

namespace {

using fuzz::Bytes;
using rayrep::Mesh;

/// Turns its cavities and its original into what is delivered.
Mesh hollowed(const Mesh& original, Bytes& bytes) {
  Mesh mesh = original;
  for (int k = bytes.below(4); k > 0; --k) {
    const double factor = bytes.number(0.05, 1);
    append(mesh,
           fuzz::shrunk_inside_out(original, factor, {bytes.number(0, 10) - 5, bytes.number(0, 10) - 5, bytes.number(0, 10) - 5}));
    if (!bytes.chance(24)) continue;
    Mesh island = fuzz::shrunk_inside_out(original, factor * bytes.number(0.1, 1), {0, 0, 0});
    flip(island);
    append(mesh, island);
  }
  return mesh;
}

/// One thing done to a mesh that a judge has to see.
void spoil(Mesh& mesh, Bytes& bytes) {
  if (mesh.triangles.empty()) return;
  const auto any = [&bytes](std::size_t size) { return static_cast<std::size_t>(bytes.two_bytes()) % size; };
  const auto t = any(mesh.triangles.size());
  const Eigen::Vector3i triangle = mesh.triangles[t];
  const double much = std::pow(10.0, bytes.number(-12, 2));
  const Eigen::Vector3d move{much * bytes.number(-1, 1), much * bytes.number(-1, 1), much * bytes.number(-1, 1)};
  const auto component_of = [&mesh](std::size_t of) {
    const rayrep::Components components = connected_components(mesh);
    std::vector<std::size_t> all;
    for (std::size_t s = 0; s < mesh.triangles.size(); ++s)
      if (components.of_triangle[s] == components.of_triangle[of]) all.push_back(s);
    return all;
  };
  switch (bytes.below(12)) {
    case 0:
      mesh.vertices[triangle[0]] += move;
      break;
    case 1:
      std::swap(mesh.triangles[t][0], mesh.triangles[t][1]);
      break;
    case 2:
      mesh.triangles.erase(mesh.triangles.begin() + static_cast<std::ptrdiff_t>(t));
      break;
    case 3:
      mesh.triangles.push_back(triangle);
      break;
    case 4:
      mesh.triangles.push_back({triangle[1], triangle[0], triangle[2]});
      break;
    case 5: {  // a shell is moved
      std::vector<bool> moved(mesh.vertices.size(), false);
      for (const std::size_t s : component_of(t))
        for (const int v : mesh.triangles[s]) moved[v] = true;
      for (std::size_t v = 0; v < moved.size(); ++v)
        if (moved[v]) mesh.vertices[v] += move;
      break;
    }
    case 6:  // a shell is turned
      for (const std::size_t s : component_of(t)) std::swap(mesh.triangles[s][0], mesh.triangles[s][1]);
      break;
    case 7:  // a shell is there twice
      for (const std::size_t s : component_of(t)) mesh.triangles.push_back(mesh.triangles[s]);
      break;
    case 8: {  // a shell is gone
      std::vector<std::size_t> all = component_of(t);
      std::reverse(all.begin(), all.end());
      for (const std::size_t s : all) mesh.triangles.erase(mesh.triangles.begin() + static_cast<std::ptrdiff_t>(s));
      break;
    }
    case 9: {  // a triangle is cut in three, its middle moved
      const int middle = static_cast<int>(mesh.vertices.size());
      mesh.vertices.push_back((mesh.corner(t, 0) + mesh.corner(t, 1) + mesh.corner(t, 2)) / 3 + move);
      mesh.triangles[t] = {triangle[0], triangle[1], middle};
      mesh.triangles.emplace_back(triangle[1], triangle[2], middle);
      mesh.triangles.emplace_back(triangle[2], triangle[0], middle);
      break;
    }
    case 10:  // two corners of it become one
      mesh.vertices[triangle[0]] = mesh.vertices[triangle[1]];
      break;
    default: {  // a shell grows
      const double factor = 1 + 0.1 * much;
      const Eigen::Vector3d middle = mesh.corner(t, 0);
      std::vector<bool> moved(mesh.vertices.size(), false);
      for (const std::size_t s : component_of(t))
        for (const int v : mesh.triangles[s]) moved[v] = true;
      for (std::size_t v = 0; v < moved.size(); ++v)
        if (moved[v]) mesh.vertices[v] = middle + factor * (mesh.vertices[v] - middle);
    }
  }
}

/// What the body before it was spoiled does, or nearly.
rayrep::Spec spec_for(const Mesh& mesh, Bytes& bytes) {
  const plain::Body body = plain::body_of(plain::surface_of(mesh));
  const Eigen::Vector3d centre(static_cast<double>(body.centre.x), static_cast<double>(body.centre.y),
                               static_cast<double>(body.centre.z));
  rayrep::Print print;
  print.wall_mm = bytes.number(0, 4);
  if (bytes.chance(20)) print.liquid_g_cm3 = 1.1;
  switch (bytes.below(5)) {
    case 0: {
      rayrep::FloatSpec spec;
      spec.print = print;
      spec.print.density_g_cm3 = bytes.number(0.3, 1.3);
      return spec;
    }
    case 1: {
      rayrep::SpinSpec spec;
      spec.print = print;
      spec.yoyo = bytes.chance(128);
      spec.centre_mm = centre;
      spec.axis.through = rayrep::SpinAxis::Through::point;
      spec.axis.point_mm = {centre.x(), centre.y(), 0};
      spec.prefer = bytes.chance(128) ? rayrep::AxisClass::largest : rayrep::AxisClass::smallest;
      return spec;
    }
    case 2: {
      rayrep::StandSpec spec;
      spec.print = print;
      if (bytes.chance(128)) spec.target_mm = centre;
      return spec;
    }
    default: {
      rayrep::TargetSpec spec;
      spec.print = print;
      const double rho = 1e-3 * print.density_g_cm3;
      const auto& I = body.inertia;
      const std::array<double, 10> has = {rho * static_cast<double>(body.volume),
                                          centre.x(),
                                          centre.y(),
                                          centre.z(),
                                          rho * static_cast<double>(I[0][0]),
                                          rho * static_cast<double>(I[1][1]),
                                          rho * static_cast<double>(I[2][2]),
                                          rho * static_cast<double>(I[0][1]),
                                          rho * static_cast<double>(I[1][2]),
                                          rho * static_cast<double>(I[0][2])};
      const int wanted = 1 + bytes.two_bytes();
      for (std::size_t k = 0; k < has.size(); ++k)
        if (wanted >> k & 1) spec.wanted[k] = has[k] * (1 + 0.002 * bytes.number(-0.6, 0.6));
      return spec;
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {  // NOLINT(readability-identifier-naming)
  static const tbb::global_control threads(tbb::global_control::max_allowed_parallelism, 1);
  if (size > 400) return 0;
  Bytes bytes(data, size);
  const Mesh original = fuzz::bodies(bytes);
  Mesh delivered = hollowed(original, bytes);
  const rayrep::Spec wanted = spec_for(delivered, bytes);
  const bool with_original = bytes.chance(170);
  for (int k = bytes.below(4); k > 0; --k) spoil(delivered, bytes);
  try {
    std::visit(
        [&](const auto& spec) {
          const auto verdict = verify(delivered, with_original ? &original : nullptr, spec);
          if (!verdict.pass()) return;
          if (const auto why = fuzz::objection(delivered, with_original ? &original : nullptr, verdict.spec, {}))
            throw std::logic_error("accepted, but " + *why);
        },
        wanted);
  } catch (const rayrep::Error& error) {
    fuzz::require(error.code() != rayrep::ErrorCode::internal, "no input makes a defect");
  }
  return 0;
}
