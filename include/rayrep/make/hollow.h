#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "rayrep/base/figure.h"
#include "rayrep/base/progress.h"
#include "rayrep/mesh/delivery.h"
#include "rayrep/mesh/mesh.h"
#include "rayrep/physics/spec.h"
#include "rayrep/rays/inner_domain.h"
#include "rayrep/rays/ray_interior.h"
#include "rayrep/solve/certify.h"
#include "rayrep/solve/solve.h"

namespace rayrep {

namespace detail {
class KeptBodies;
}

/// How the inside is discretised and built, for every goal.
struct HollowOptions {
  int resolution = 200;         ///< rays along the longest side, 20 to 1000
  double min_cavity_mm3 = 4.0;  ///< a ball of 2 mm; smaller cavities are filled
  /// As-built passes: after each meshing the difference between the mesh's exact moments and the model's is fed back and the
  /// problem is solved again, until the mesh meets mass and offset to `as_built_tolerance` (relative to mass and to the diagonal).
  /// theory.md (16d). A mesh that misses it after the last pass is delivered all the same: a judge says what it is.
  int max_passes = 6;
  double as_built_tolerance = 1e-6;
  Solver solver = Solver::quadric;                 ///< targets: quadric only
  SolveOptions solve;                              ///< of Ipopt, where it is the solver
  SegmentBounds bounds = SegmentBounds::complete;  ///< of Solver::rays when spinning
  double start_fill = 0.5;  ///< where Ipopt starts on segments: 1 all solid, 0 all void; half takes the fewest iterations mostly
  /// What storing does to coordinates (e.g. rounding to float32), see as_stored in mesh_io.h; empty: nothing.
  std::function<Mesh(const Mesh&)> as_stored;
  /// The ten moments, unit density, of what a printer lays down for what is delivered, in the frame of the mesh that is given;
  /// empty: a print is taken to be its mesh. With it the body is made such that not its mesh but its print meets the goal.
  /// theory.md (45)
  std::function<Moments(const Delivery&)> as_printed;
  /// Bodies inside that are not printed (a magnet, a bolt, a coin): known masses, whose room is kept free and as far from surface
  /// and cavities as the wall. In the frame of the mesh that is given, facing outward.
  std::vector<FixedBody> fixed = {};
  /// Regions in which the body stays solid (a hook, an eye, a boss for a screw), and as far around as the wall. In the frame of the
  /// mesh that is given, closed, facing outward; they may reach out of it.
  std::vector<Mesh> keep_solid = {};
  /// Likewise of pillars (Print::self_supporting_deg): as far around them as their own clearance, which is at most the wall.
  std::vector<Mesh> pillars = {};
  double pillar_clearance_mm = 0;
  /// Heights above the lowest point at which the print is paused to put them in; empty: those of the tops of their rooms.
  std::vector<double> pauses_mm = {};
  /// Only a look at what is in reach, with nothing made after it: the grid of the cavity need not be finer than half of the rays',
  /// and rays that miss thin parts are turned but not made more.
  bool look_only = false;
  /// What was built for looks before this one and may serve again, see Previewer; null: nothing.
  std::shared_ptr<detail::KeptBodies> kept = {};
  int max_slices = 3;  ///< how often as_printed is asked
  /// No further slice is made once a print misses mass and offset by no more than this (as as_built_tolerance).
  double as_printed_tolerance = 3e-5;
};

/// The rows that set them, those that mean something for such a spec.
Settings settings(HollowOptions& options, const Spec& spec);

/// One of Print::balls.
struct Ball {
  Eigen::Vector3d centre_mm;  ///< in the frame of the mesh that was given
  double pause_mm = 0;        ///< above the lowest point along the print's direction: the height of the layer above its pocket
};

/// A hollowed body and how it came about.
struct HollowResult {
  /// The untouched outer surface, then the cavity shells, or the sparse regions as modifiers; in the frame of the mesh that was
  /// given.
  Delivery delivery;
  Spec spec;  ///< what a judge is to hold it to: waterline, axis, contact point, target filled in as they were found
  std::size_t cavities = 0;
  std::size_t filled_cavities = 0;  ///< too small to print
  double filled_mm3 = 0;
  std::size_t removed_islands = 0;  ///< specks of material that would have floated in a cavity
  CastReport cast;
  std::size_t dropped_components = 0;  ///< pieces of the inner domain too small to print
  double ray_spacing_mm = 0;
  double field_spacing_mm = 0;
  /// To the working frame: up = z, lowest point at z = 0, box centred in x, y. Spin: contact point or centre at the origin. Target:
  /// the wanted centre of mass, as far as given, at the origin and z along the rays.
  Eigen::Affine3d to_working = Eigen::Affine3d::Identity();
  Moments q = Moments::Zero();  ///< working frame: material of the inner domain is where q.phi < 0, the cavity where q.phi > 0
  double price = 0;             ///< with a limit on the core's volume: it is where q.phi < -price, and plain material in between
  SolveReport solve;            ///< of the last pass
  int solver_iterations = 0;    ///< over all passes
  int passes = 0;
  double as_built_error = 0;  ///< of the delivered mesh, to compare with HollowOptions::as_built_tolerance
  /// One asking of HollowOptions::as_printed.
  struct Slice {
    double excess = 0;  ///< volume of the print over that of the mesh, less 1
    double error = 0;   ///< of the print, to compare with HollowOptions::as_printed_tolerance
  };
  std::vector<Slice> slices;   ///< in order; empty without as_printed
  std::size_t best_slice = 0;  ///< which of them is delivered
  bool gave_way = false;       ///< the prints jumped past the waterline that was found: it is that of the print now
  double wall_mm = 0;          ///< of the cavity: thicker than asked for when all ten numbers of a target were wanted

  std::vector<Ball> balls;  ///< in the order in which they are put in

  // What is proven.
  std::optional<double> duality_gap;  ///< (objective - proven lower bound) / |bound| on these rays, last pass; may be -1e-7
  std::optional<SpinCertificate> certificate;  ///< of a spin's first pass, on request
  /// Of a target: the number that was minimised first, found and bounded; none: not one of the ten, or all of them were wanted.
  struct Extreme {
    InertialWish wish;
    double found = 0;  ///< of the solver's body, last pass; unit of InertialTargets
    double bound = 0;  ///< proven: no interior on these rays with the wanted numbers has less (more, if largest)
  };
  std::optional<Extreme> extreme;
  std::vector<std::string> proof;  ///< the same in sentences
  Figures proof_figures;           ///< and in figures
};

/// Computes the inside of a body so that it does what `spec` says: floats upright (ray-reps paper, Eq. 3-6 and 11; theory.md
/// (10)-(17)), spins stably about an axis as a top (ray-reps paper, Eq. 7-10; Spin-It, Eq. 3) or as a yo-yo (Spin-It, Eq. 5),
/// stands with its centre of mass above a point of the support polygon, as low as it goes, or has any of its ten numbers given. Of
/// a target what is free is minimised in the stated order; with all ten given nothing is: then the wall is made as thick as they
/// allow, which singles out one body. (HollowOptions::as_built_tolerance holds then too, but at the very edge of what is possible,
/// where the mass hardly depends on the wall, only some 1e-4 may be reached.)
/// @param solid  closed, oriented, positive volume: see require_solid. Overlapping components count as their union.
/// @throws Error{usage} for options or a spec that make no sense; Error{goal} with figures and remedies when the wall leaves no
///         inside or the goal cannot be met; Error{solver} when the solver stops; Error{interrupted}.
/// A result is not yet a success: that is for verify to say.
HollowResult hollow(const Mesh& solid, const Spec& spec, const HollowOptions& options = {}, const Progress& progress = {});

}  // namespace rayrep
