#pragma once

#include <functional>
#include <memory>

#include "make/body.h"
#include "rayrep/physics/spec.h"
#include "shape/cage.h"
#include "shape/sensitivity.h"
#include "shape/shortfall.h"

namespace rayrep::detail {

/// What a goal wants of one outside, and how that changes with it.
struct Wish {
  Wanted wanted;
  /// Sets rows that depend on the moments they are met with for s, for which the values are then least; empty: none do.
  std::function<void(const Moments& s, Wanted& wanted)> adapt;
  /// Adds the change of normal . (rows s + offset) at moments s that stay as they are, by what of rows and offset depends on the
  /// outside: a foot, an axis, the displaced water. q = rows^T normal.
  std::function<void(const Moments& q, const Eigen::VectorXd& normal, const Moments& s, VertexGradient& gradient)> add_explicit;
};

/// A goal as seen by the search for an outside that meets it. All bodies are in the frame of the first one.
class Wisher {
public:
  virtual ~Wisher() = default;
  virtual Wish wish(const Body& body) const = 0;
  /// Which vertices of the first body do not move freely, as the frame hangs on them.
  virtual void hold(const Mesh& mesh, double blend_mm, Freedom& freedom) const = 0;
};

/// @param margin    see DeformOptions
/// @param first     the body before it is deformed, in its working frame
/// @param outer     see outer_triangles
std::unique_ptr<Wisher> wisher(const StandSpec& spec, double margin, const Body& first);
std::unique_ptr<Wisher> wisher(const SpinSpec& spec, double margin, const Body& first, const std::vector<char>& outer);
std::unique_ptr<Wisher> wisher(const FloatSpec& spec, double margin, const Body& first);

/// 0 at 0 and below, 1 at 1 and above, with continuous second derivatives.
double smooth_step(double t);

}  // namespace rayrep::detail
