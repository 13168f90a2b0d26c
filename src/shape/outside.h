#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "rayrep/shape/deform.h"
#include "shape/cage.h"
#include "shape/wish.h"

namespace rayrep::detail {

/// One direction in which what is attainable falls short of what is wanted, and how that changes with the handles. theory.md (61)
struct Cut {
  Eigen::VectorXd normal;
  double value = 0;  ///< min over all interiors of normal . values, plus the room for equations
  Handles slope;
};

/// An outside and what its interiors can do.
struct Look {
  Handles handles;
  Mesh mesh;  ///< in the frame given
  std::vector<Cut> cuts;
  double worst = 0;     ///< of the cuts; at most 0: the goal can be met with its margin
  double distance = 0;  ///< of what is attainable from what is wanted, without that room
};

/// The outsides of a body that a cage can give it.
class Outside {
public:
  struct Problem {
    const Mesh& solid;      ///< in the frame given
    Eigen::Affine3d frame;  ///< to the working frame, in which all are
    const Spec& spec;
    const HollowOptions& options;
    const DeformOptions& how;
  };
  Outside(const Problem& problem, const Progress& progress);

  Cage& cage() { return *cage_; }
  const Cage& cage() const { return *cage_; }
  int looks() const { return looks_; }

  Mesh deformed(const Handles& handles) const;
  Eigen::Index values() const;  ///< of what is wanted

  /// @param before  cuts of a neighbouring outside: their directions are looked at again
  Look look(const Handles& handles, const std::vector<Cut>& before);

  /// What is wanted from now on. @param room  with which equations are to be met
  void ask(double margin, double room);

private:
  std::unique_ptr<Body> body_of(const Mesh& mesh) const;
  Cut cut_at(const Eigen::VectorXd& normal, const Body& body, const Wish& wish, const WallSamples& wall) const;
  Shortfall reach_of(const Eigen::VectorXd& shift, const Body& body, const Wish& wish) const;

  Problem problem_;
  Progress progress_;
  Discretisation discretisation_;
  Phases phases_;
  std::vector<char> outer_;
  std::unique_ptr<Body> first_;
  std::unique_ptr<Wisher> wisher_;
  std::optional<Cage> cage_;
  double room_ = 0;
  int looks_ = 0;
};

}  // namespace rayrep::detail
