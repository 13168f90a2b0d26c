#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "rayrep/io/printed.h"
#include "rayrep/mesh/section.h"

namespace rayrep::detail {

/// Collects the closed loops of perimeters of one layer after the other, and makes its outline of the outermost.
class PrintedOutline {
public:
  /// A bead of a perimeter. Beads that follow each other without a gap make one path.
  void add(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double width_mm);
  /// The path is over: nothing that comes is part of it.
  void end_path();
  /// The layer is over.
  /// @param top_mm  of its beads
  void end_layer(double top_mm, double height_mm, std::vector<PrintedLayer>& layers);

private:
  std::vector<Eigen::Vector2d> points_;  ///< of the path
  std::vector<double> widths_;           ///< of its beads
  std::vector<SectionLoop> loops_;       ///< of the middles of beads
  std::vector<LoopMoments> areas_;       ///< of loops_, out to the beads' outer edges, positive
  std::vector<Eigen::AlignedBox2d> boxes_;
};

}  // namespace rayrep::detail
