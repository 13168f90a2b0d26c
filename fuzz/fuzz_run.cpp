// Whole runs on few rays: what is delivered is closed and keeps its outer surface, what is proven is not contradicted, what the
// judge accepts stands up to a second opinion, and nothing but Error is thrown.

#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <variant>

#include "bodies.h"
#include "plain.h"
#include "rayrep/base/error.h"
#include "rayrep/judge/verify.h"
#include "rayrep/make/hollow.h"
#include "rayrep/mesh/mesh_check.h"
#include "rayrep/physics/moments.h"
#include "second_opinion.h"

namespace {

using fuzz::Bytes;
using fuzz::require;
using rayrep::HollowOptions;
using rayrep::HollowResult;
using rayrep::Mesh;

rayrep::Spec spec_for(const Mesh& mesh, Bytes& bytes) {
  const Eigen::AlignedBox3d box = bounding_box(mesh);
  const Eigen::Vector3d size = box.sizes();
  rayrep::Print print;
  print.wall_mm = size.maxCoeff() * bytes.number(0.04, 0.15);
  print.density_g_cm3 = bytes.number(0.6, 1.6);
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  if (bytes.chance(40)) up = {bytes.number(-1, 1), bytes.number(-1, 1), bytes.number(-1, 1) + 0.001};
  switch (bytes.below(5)) {
    case 0: {
      rayrep::FloatSpec spec;
      spec.print = print;
      spec.up = up;
      if (bytes.chance(128)) spec.submerged_fraction = bytes.number(0.2, 0.95);
      return spec;
    }
    case 1:
    case 2: {
      rayrep::SpinSpec spec;
      spec.print = print;
      spec.up = up;
      spec.yoyo = bytes.chance(100);
      spec.prefer = bytes.chance(200) ? rayrep::AxisClass::largest : rayrep::AxisClass::smallest;
      spec.objective = bytes.chance(200) ? rayrep::SpinSpec::Objective::rayreps : rayrep::SpinSpec::Objective::spinit;
      spec.certify =
          bytes.chance(40) && spec.prefer == rayrep::AxisClass::largest && spec.objective == rayrep::SpinSpec::Objective::rayreps;
      if (!spec.yoyo)
        spec.axis.through = bytes.chance(128) ? rayrep::SpinAxis::Through::centre_of_mass : rayrep::SpinAxis::Through::lowest_point;
      return spec;
    }
    case 3: {
      rayrep::StandSpec spec;
      spec.print = print;
      spec.up = up;
      if (bytes.chance(100))
        spec.target_mm = box.center() + Eigen::Vector3d{size.x() * bytes.number(-0.3, 0.3), size.y() * bytes.number(-0.3, 0.3), 0};
      if (bytes.chance(60)) spec.objective = rayrep::StandSpec::Objective::tip_angle;
      return spec;
    }
    default: {
      rayrep::TargetSpec spec;
      spec.print = print;
      const rayrep::MassProperties solid = rayrep::mass_properties(mesh, print.density_g_cm3);
      const int wanted = bytes.two_bytes();
      for (int k = 0; k < 10; ++k) {
        if (!(wanted >> k & 1)) continue;
        const auto number = static_cast<rayrep::MomentIndex>(k);
        const double has = inertial_number(solid, number);
        const bool centre = k >= rayrep::MX && k <= rayrep::MZ;
        spec.wanted[static_cast<std::size_t>(k)] =
            centre ? has + 0.1 * size[k - 1] * bytes.number(-1, 1) : has * bytes.number(0.3, 1);
      }
      if (wanted >> 10 & 1) spec.order = {{static_cast<rayrep::MomentIndex>(bytes.below(10)), bytes.chance(128)}};
      return spec;
    }
  }
}

void check_delivery(const Mesh& solid, const HollowResult& result) {
  const Mesh delivered = result.delivery.body();
  require(plain::is_closed(plain::surface_of(delivered)), "what is delivered is closed");
  require(delivered.triangles.size() >= solid.triangles.size(), "what is delivered holds the outer surface");
  for (std::size_t t = 0; t < solid.triangles.size(); ++t)
    for (int k = 0; k < 3; ++k) require(delivered.corner(t, k) == solid.corner(t, k), "the outer surface is delivered as it was");
  for (const auto& v : delivered.vertices) require(v.allFinite(), "coordinates are finite");
}

void check_proof(const HollowResult& result) {
  if (result.duality_gap) require(*result.duality_gap >= -1e-6, "what is proven is not above what was found");
  if (const auto& c = result.certificate) {
    require(!c->infeasible, "what was found is possible");
    const double found = c->best.objective;
    require(c->lower_bound <= found + 1e-9 * std::abs(found), "the certified bound is not above the best");
  }
  if (const auto& e = result.extreme) {
    const double sign = e->wish.largest ? -1 : 1;
    require(sign * (e->found - e->bound) >= -1e-6 * std::max(std::abs(e->found), std::abs(e->bound)),
            "an extreme is within its bound");
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {  // NOLINT(readability-identifier-naming)
  static const tbb::global_control threads(tbb::global_control::max_allowed_parallelism, 1);
  if (size > 200) return 0;
  Bytes bytes(data, size);
  try {
    const rayrep::CheckedMesh checked = rayrep::check_mesh(fuzz::bodies(bytes));
    if (!checked.report.usable) return 0;
    const rayrep::Spec wanted = spec_for(checked.mesh, bytes);
    HollowOptions options;
    options.resolution = 20;
    options.max_passes = 1 + bytes.below(4);
    if (bytes.chance(30) && !std::holds_alternative<rayrep::TargetSpec>(wanted)) options.solver = rayrep::Solver::rays;
    const HollowResult result = hollow(checked.mesh, wanted, options);
    check_delivery(checked.mesh, result);
    check_proof(result);
    const Mesh delivered = result.delivery.body();
    std::visit(
        [&](const auto& spec) {
          const auto verdict = verify(delivered, &checked.mesh, spec);
          if (!verdict.pass()) return;
          if (const auto why = fuzz::objection(delivered, &checked.mesh, verdict.spec, {}))
            throw std::logic_error("accepted, but " + *why);
        },
        result.spec);
  } catch (const rayrep::Error& error) {
    require(error.code() != rayrep::ErrorCode::internal, "no input makes a defect");
  }
  return 0;
}
