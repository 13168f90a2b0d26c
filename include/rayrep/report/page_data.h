#pragma once

#include <string>
#include <utility>
#include <vector>

#include "rayrep/mesh/delivery.h"
#include "rayrep/mesh/mesh.h"
#include "rayrep/report/report.h"

namespace rayrep {

/// What the page of html.h is given, without the page: tools/report/README.md says what is in it.
struct PageData {
  std::string json;                                         ///< of the block rayrep-data
  std::vector<std::pair<std::string, std::string>> meshes;  ///< packed, in base64, by the ids of their blocks
};

PageData page_data(const RunReport& report, const Delivery& delivered);
PageData page_data(const Inspection& inspection, const Delivery& inspected);
/// Of a page that to_html has written. @throws Error{input} for any other text
PageData page_data(const std::string& page);

/// What a verdict alone tells, as JSON: `told` (sentences), `figures` (words, unit, value and name of what is a number, a list of
/// numbers, or null), `rows` and `criteria` as in the page's data, `after` as in a report's, and `attitudes` as in its view.
/// @param body  whose lowest and highest points are told
std::string page_json(const Verdict& verdict, const Mesh& body);

/// The page with nothing to show but what its script asks for.
struct LivePage {
  std::string html;
  std::string policy;  ///< its Content-Security-Policy, which it does not say itself
};
/// @param json  of its block rayrep-studio
LivePage live_page(const std::string& json);

}  // namespace rayrep
