#pragma once

#include <string_view>

namespace rayrep::report_detail {

/// The page as tools/report/bundle.sh makes it, without what it shows. Where that goes: kTitle, kPlainText, kData, each once.
std::string_view page();
inline constexpr std::string_view kTitle = "rayrep:title";
inline constexpr std::string_view kPlainText = "rayrep:plain-text";
inline constexpr std::string_view kData = "<!--rayrep:data-->";

}  // namespace rayrep::report_detail
