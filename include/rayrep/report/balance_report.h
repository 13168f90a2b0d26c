#pragma once

#include <optional>
#include <string>
#include <vector>

#include "rayrep/judge/verify_mechanism.h"
#include "rayrep/make/balance.h"
#include "rayrep/physics/mechanism.h"

namespace rayrep {

/// What came of balancing a thing of several parts, or of judging it as it is.
struct BalanceReport {
  std::string scene;                  ///< name of its file
  Mechanism mechanism;                ///< as it was judged
  std::optional<BalanceResult> made;  ///< none: the parts were judged as they are
  MechanismVerdict verdict;
  std::vector<std::string>
      outputs;  ///< of the printed parts, in order; then the scene with these in place of its own. None: nothing written
};

/// docs/report.schema.json.
std::string to_json(const BalanceReport& report);
/// For people.
std::string to_text(const BalanceReport& report);

}  // namespace rayrep
