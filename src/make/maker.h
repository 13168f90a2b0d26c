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

/// Turns a switching function into a thing whose ten moments are known exactly. The as-built loop sees nothing else of it.
class Maker {
public:
  virtual ~Maker() = default;

  /// Makes what q says: material where q.phi < 0. It may only adapt what it made for the last q.
  virtual void make(const Moments& q) = 0;
  /// Makes it anew, whatever came before.
  virtual void make_anew(const Moments& q) = 0;
  /// What is made from now on is made on the finest grid that is of use. @returns false when it was that fine already
  virtual bool refine() = 0;

  virtual bool adapted() const = 0;            ///< the last make only adapted what was there
  virtual bool spoilt() const = 0;             ///< adapting has spoilt it: it must be made anew
  virtual const Moments& moments() const = 0;  ///< of the whole body, unit density, working frame
  virtual Made made() const = 0;
};

}  // namespace rayrep::detail
