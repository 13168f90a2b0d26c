#pragma once

#include <string>
#include <string_view>

#include "rayrep/report/page_data.h"

namespace rayrep::report_detail {

/// The page as tools/report/bundle.sh makes it, without what it shows. Where that goes: kTitle, kPlainText, kData, each once.
std::string_view page();
inline constexpr std::string_view kTitle = "rayrep:title";
inline constexpr std::string_view kPlainText = "rayrep:plain-text";
inline constexpr std::string_view kData = "<!--rayrep:data-->";

/// The page with all of it.
std::string written(const std::string& title, const std::string& plain_text, const PageData& data);

}  // namespace rayrep::report_detail
