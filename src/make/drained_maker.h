#pragma once

#include <memory>
#include <vector>

#include "make/drained_places.h"
#include "make/maker.h"
#include "rayrep/mesh/boolean.h"

namespace rayrep::detail {

/// Drills holes through the wall of what another one makes, and makes their plugs. Where they are is found with the first
/// cavities, and kept while they drain the next ones: the as-built loop makes up for what they take. theory.md (103), (104)
class DrainedMaker final : public Maker {
public:
  /// Keeps references. @param spec  filled in
  DrainedMaker(std::unique_ptr<Maker> cavities, const Body& body, const Spec& spec, const HollowOptions& options,
               const Progress& progress);

  void make(const Switching& switching) override;
  void make_anew(const Switching& switching) override;
  bool refine() override { return cavities_->refine(); }
  bool take_all() override { return cavities_->take_all(); }
  bool adapted() const override { return cavities_->adapted(); }
  bool spoilt() const override { return cavities_->spoilt(); }
  bool renewed() const override { return renewed_; }
  bool floods() const override { return floods_; }
  const Moments& moments() const override { return moments_; }
  Made made() const override;

  /// The mouths of the holes, in the frame given.
  std::vector<Eigen::Vector3d> mouths() const;

private:
  void drill_all();
  Mesh drilled(const Mesh& mesh, const std::vector<DrainHole>& holes) const;
  std::vector<Mesh> plugs_in(const Mesh& mesh) const;
  Mesh stored(const CombinedMesh& mesh) const;
  Moments liquid() const;
  Eigen::Affine3d beside_the_body(const Mesh& plug, double beside_mm) const;

  std::unique_ptr<Maker> cavities_;
  const Body& body_;
  const Print& print_;
  const HollowOptions& options_;
  const Progress& progress_;
  bool float32_;  ///< as it will be stored
  DrainPlaces places_;
  std::optional<std::vector<DrainHole>> holes_;
  int found_ = 0;  ///< so often
  bool renewed_ = false;
  bool floods_ = false;  ///< in this run
  Moments fixed_;        ///< what is fixed in the body, working frame
  Mesh mesh_;            ///< with the holes, as stored
  std::vector<Mesh> plugs_;
  Moments moments_ = Moments::Zero();
};

}  // namespace rayrep::detail
