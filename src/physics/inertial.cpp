#include "rayrep/physics/inertial.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "rayrep/base/error.h"

namespace rayrep {
namespace {

struct Place {
  int row, column;
};

/// Of MXX ... MXZ in a symmetric matrix.
Place place(MomentIndex number) {
  constexpr Place places[] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {0, 2}};
  return places[number - MXX];
}

/// The shortest text that is read as the same number.
std::string shortest(double value) {
  std::string text;
  append_number(text, value + 0.0);  // -0 becomes 0
  return text;
}

struct SiProperties {
  double mass_kg;
  Eigen::Vector3d centre_m;
  Eigen::Matrix3d inertia_kg_m2;
};

SiProperties si(const MassProperties& body) {
  if (!(body.mass_g > 0) || !std::isfinite(body.mass_g) || !body.centre_of_mass_mm.allFinite() || !is_physical(body.inertia_g_mm2))
    throw Error(ErrorCode::input,
                "These are not the mass properties of a body: the mass must be positive and the inertia tensor positive definite, "
                "with no principal moment larger than the sum of the two others.");
  return {body.mass_g / 1e3, body.centre_of_mass_mm / 1e3, body.inertia_g_mm2 / 1e9};
}

std::string three(const Eigen::Vector3d& v) { return shortest(v.x()) + " " + shortest(v.y()) + " " + shortest(v.z()); }

}  // namespace

const char* inertial_name(MomentIndex number) {
  constexpr const char* names[] = {"mass", "com_x", "com_y", "com_z", "ixx", "iyy", "izz", "ixy", "iyz", "ixz"};
  return names[number];
}

double inertial_number(const MassProperties& body, MomentIndex number) {
  if (number == M1) return body.mass_g;
  if (number <= MZ) return body.centre_of_mass_mm[number - MX];
  return body.inertia_g_mm2(place(number).row, place(number).column);
}

std::vector<InertialDeviation> inertial_deviations(const InertialTargets& wanted, const MassProperties& body, double length_mm) {
  std::vector<InertialDeviation> deviations;
  for (int k = M1; k <= MXZ; ++k) {
    if (!wanted[static_cast<std::size_t>(k)]) continue;
    InertialDeviation d;
    d.number = static_cast<MomentIndex>(k);
    d.wanted = *wanted[static_cast<std::size_t>(k)];
    d.found = inertial_number(body, d.number);
    double unit = std::abs(d.wanted);
    if (k >= MX && k <= MZ) unit = length_mm;
    if (k >= MXY) {
      const auto [i, j] = place(d.number);
      unit = std::sqrt(body.inertia_g_mm2(i, i) * body.inertia_g_mm2(j, j));
    }
    d.relative = std::abs(d.found - d.wanted) / unit;
    deviations.push_back(d);
  }
  return deviations;
}

bool is_physical(const Eigen::Matrix3d& inertia) {
  if (!inertia.allFinite()) return false;
  const Eigen::Vector3d principal =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(inertia, Eigen::EigenvaluesOnly).eigenvalues();  // ascending
  return principal[0] > 0 && principal[2] <= principal[0] + principal[1] + 1e-12 * principal[2];
}

std::string urdf_inertial(const MassProperties& body) {
  const SiProperties p = si(body);
  const Eigen::Matrix3d& I = p.inertia_kg_m2;
  return "<inertial>\n  <origin xyz=\"" + three(p.centre_m) + "\" rpy=\"0 0 0\"/>\n  <mass value=\"" + shortest(p.mass_kg) +
         "\"/>\n  <inertia ixx=\"" + shortest(I(0, 0)) + "\" ixy=\"" + shortest(I(0, 1)) + "\" ixz=\"" + shortest(I(0, 2)) +
         "\" iyy=\"" + shortest(I(1, 1)) + "\" iyz=\"" + shortest(I(1, 2)) + "\" izz=\"" + shortest(I(2, 2)) +
         "\"/>\n</inertial>\n";
}

std::string mjcf_inertial(const MassProperties& body) {
  const SiProperties p = si(body);
  const Eigen::Matrix3d& I = p.inertia_kg_m2;
  return "<inertial pos=\"" + three(p.centre_m) + "\" mass=\"" + shortest(p.mass_kg) + "\" fullinertia=\"" + three(I.diagonal()) +
         " " + three({I(0, 1), I(0, 2), I(1, 2)}) + "\"/>\n";
}

std::string missing_for(MomentIndex number, const InertialTargets& targets) {
  const auto has = [&](int axis) { return targets[static_cast<std::size_t>(MX + axis)].has_value(); };
  const auto name = [](int axis) { return std::string(1, "xyz"[axis]); };
  if (number < MXX) return "";
  if (number <= MZZ) {
    const int a = (number - MXX + 1) % 3;
    const int b = (number - MXX + 2) % 3;
    if (has(a) && has(b)) return "";
    return name(std::min(a, b)) + " and " + name(std::max(a, b));
  }
  const int a = number == MYZ ? 1 : 0;
  const int b = number == MXY ? 1 : 2;
  if (has(a) || has(b)) return "";
  return name(a) + " or " + name(b);
}

}  // namespace rayrep
