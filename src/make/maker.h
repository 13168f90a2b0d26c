#pragma once

#include "rayrep/mesh/delivery.h"
#include "rayrep/physics/moments.h"

namespace rayrep::detail {

/// What a maker has made.
struct Made {
  Delivery delivery;  ///< in the frame given, as it will be stored
  std::size_t cavities = 0;
  std::size_t filled_cavities = 0;  ///< left out because they were too small
  double filled_mm3 = 0;
  std::size_t removed_islands = 0;
};

/// What is where, by the value of q.phi: the lighter phase where it is positive; where the denser one is scarce, that only where
/// it is below -price, and plain material in between (theory.md (49)).
struct Switching {
  Moments q;
  double price = 0;
};

/// Turns a switching function into a thing whose ten moments are known exactly. The as-built loop sees nothing else of it.
class Maker {
public:
  virtual ~Maker() = default;

  /// Makes what it says. It may only adapt what it made before.
  virtual void make(const Switching& switching) = 0;
  /// Makes it anew, whatever came before.
  virtual void make_anew(const Switching& switching) = 0;
  /// What is made from now on is made on the finest grid that is of use. @returns false when it was that fine already
  virtual bool refine() = 0;
  /// What is made from now on takes all of the inner domain that there is, at the price of more triangles.
  /// @returns false when it did so already
  virtual bool take_all() { return false; }

  virtual bool adapted() const = 0;               ///< the last make only adapted what was there
  virtual bool spoilt() const = 0;                ///< adapting has spoilt it: it must be made anew
  virtual bool renewed() const { return false; }  ///< it has become another body, of which errors before say nothing
  virtual bool floods() const { return false; }   ///< liquid that stays in it weighs, and takes the place of what is taken away
  virtual const Moments& moments() const = 0;     ///< of the whole body, unit density, working frame
  virtual Made made() const = 0;
};

}  // namespace rayrep::detail
