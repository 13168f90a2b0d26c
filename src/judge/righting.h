#pragma once

// How the judge of floating tells of righting arms.

#include <optional>
#include <string>

#include "rayrep/base/figure.h"
#include "rayrep/physics/righting_arm.h"

namespace rayrep::verify_detail {

/// The curve for JSON, and its range, largest arm and area for a table too; without a curve all of these without a value.
void add_righting(const std::optional<RightingCurve>& curve, Figures& figures);

/// How far it "rights itself": "from any heel up to 74.2 degrees; beyond, with its +y side down, it turns over. ..."
std::string righting_words(const RightingCurve& curve);

}  // namespace rayrep::verify_detail
