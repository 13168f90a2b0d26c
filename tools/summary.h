#pragma once

#include <string>

#include "rayrep/report.h"

namespace rayrep::tool {

/// The summary of a float or verify run for a terminal: what came in, before and after side by side, verdict per criterion.
std::string summary(const FloatReport& report, bool verbose);

/// The same of a spin and of a stand run.
std::string summary(const SpinReport& report, bool verbose);
std::string summary(const StandReport& report, bool verbose);

/// The summary of an inspection. `mass` is null for a mesh that cannot be used.
std::string summary(const InputSummary& input, double density_g_cm3, double area_mm2, const MassProperties* mass);

}  // namespace rayrep::tool
