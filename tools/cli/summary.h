#pragma once

#include <string>

#include "rayrep/report/report.h"

namespace rayrep::tool {

/// The summary of a run for a terminal: what came in, before and after side by side (of a verify run: after alone), verdict per
/// criterion. Of a spin that wrote a mesh, `verbose` adds the command line that judges it again.
std::string summary(const FloatReport& report, bool verbose);
std::string summary(const SpinReport& report, bool verbose);
std::string summary(const StandReport& report, bool verbose);
std::string summary(const TargetReport& report, bool verbose);

/// The summary of an inspection. `mass` is null for a mesh that cannot be used.
std::string summary(const InputSummary& input, double density_g_cm3, double area_mm2, const MassProperties* mass);

}  // namespace rayrep::tool
