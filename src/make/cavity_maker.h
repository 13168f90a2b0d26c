#pragma once

#include "make/body.h"
#include "make/clipped_cavity.h"
#include "make/maker.h"
#include "rayrep/make/cavity.h"

namespace rayrep::detail {

/// What a cavity in this body is held to. Keeps references to body and options.
CavityOptions cavity_options(const Body& body, const Print& print, const HollowOptions& options);

/// A cavity where q.phi > 0, at least the wall from the surface, as a mesh: cut from the surface at the wall's distance while that
/// goes, then meshed on the grid.
class CavityMaker final : public Maker {
public:
  /// How it is made first.
  enum class By {
    cut,  ///< of a lighter surface
    grid  ///< meshed: smooth in the wall, too
  };
  /// Keeps references to all.
  CavityMaker(Body& body, const Print& print, const HollowOptions& options, const Progress& progress, By by = By::cut);

  void make(const Switching& switching) override;
  void make_anew(const Switching& switching) override;
  bool refine() override;
  bool take_all() override;
  bool adapted() const override { return followed_; }
  bool spoilt() const override;
  const Moments& moments() const override { return moments_; }
  Made made() const override;

private:
  bool follow(const Switching& switching);
  void measure();

  Body& body_;
  const Print& print_;
  const HollowOptions& options_;
  const Progress& progress_;
  By by_;
  CavityOptions cavity_options_;
  std::optional<ClippedCavity> clipped_;
  bool cuts_;          ///< no cut has failed
  CavityMesh cavity_;  ///< working frame
  Mesh shells_;        ///< as stored, in the frame given
  Moments moments_ = Moments::Zero();
  std::size_t crossing_anew_ = 0;  ///< triangles that crossed when it was meshed last
  bool followed_ = false;
};

}  // namespace rayrep::detail
