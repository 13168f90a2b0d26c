#pragma once

#include <vector>

#include "make/body.h"
#include "make/maker.h"
#include "rayrep/make/cavity.h"

namespace rayrep::detail {

/// A core where q.phi < 0 and a cavity where q.phi > 0, at least the wall from the surface: the body with the room for both, and
/// the core as an insert. theory.md (48)
class CoreMaker final : public Maker {
public:
  /// Keeps references to all.
  CoreMaker(Body& body, const Print& print, const HollowOptions& options, const Progress& progress);

  void make(const Switching& switching) override;
  void make_anew(const Switching& switching) override;
  bool refine() override;
  bool adapted() const override { return followed_; }
  bool spoilt() const override;
  const Moments& moments() const override { return moments_; }
  Made made() const override;

private:
  /// A part of the inside as a mesh in the working frame.
  struct Region {
    enum class Where { everywhere, cavity, core } where = Where::everywhere;
    double inset_mm = 0;  ///< what is printed of the partition on its side
    double clearance_mm = 0;
    CavityMesh mesh = {};
    std::size_t crossing_anew = 0;  ///< triangles that crossed when it was meshed last

    Moments switching(const Switching& switching) const;
  };

  CavityOptions options_of(const Region& region) const;
  void measure();

  Body& body_;
  const Print& print_;
  const HollowOptions& options_;
  const Progress& progress_;
  Region room_;  ///< of the cavity; without a partition of all that is inside, the core too
  Region core_;
  Mesh shells_;  ///< of the rooms, as stored, in the frame given
  Mesh core_shells_;
  Moments moments_ = Moments::Zero();
  bool followed_ = false;
};

}  // namespace rayrep::detail
