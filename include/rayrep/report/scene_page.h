#pragma once

#include <string>

#include "rayrep/motion/motion_check.h"
#include "rayrep/motion/scene.h"
#include "rayrep/report/balance_report.h"
#include "rayrep/report/page_data.h"

namespace rayrep {

/// What a page of a scene tells beside the scene and what was found.
struct ScenePage {
  std::string name;         ///< of its file
  double tolerance = 1e-3;  ///< MotionCheckOptions::tolerance, with which it was looked at
  /// How it rests in its states, of the scene's own parts; null: that was not judged.
  const BalanceReport* balance = nullptr;
};

/// A page of one file that needs nothing else: whether parts get into each other, when and where, with all parts in 3D at any time
/// of each way, a timeline, and the states with the ways between them, and how it rests in those. The same bytes for the same
/// report.
///
/// Coordinates are rounded to 1/65535 of each part's box along each axis; what is shown is coarser where all parts together have
/// more than 600,000 triangles, and the page says so. Times, boxes and contours are those of the report.
std::string to_html(const Scene& scene, const MotionReport& report, const ScenePage& page);

/// The same without the page: tools/report/README.md, "A scene".
PageData page_data(const Scene& scene, const MotionReport& report, const ScenePage& page);

/// Of these data what changes with every look: `found`.
std::string found_json(const Scene& scene, const MotionReport& report, const ScenePage& page);

/// How it rests in its states: `balance`.
std::string balance_json(const Scene& scene, const BalanceReport& report);

}  // namespace rayrep
