#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "options.h"

// What can be set in the studio: the rows of the commands that hollow, without what names files and programs.

namespace rayrep::tool {

/// What a page asks for: a goal and settings, as texts of the command line, in the order given.
struct Wanted {
  std::string goal = FloatSpec::kGoal;
  std::vector<std::pair<std::string, std::string>> settings;  ///< "" of a switch
  std::uint64_t sequence = 0;
};

/// From {"goal": "float", "settings": {"waterline": 22}, "sequence": 17}, values as in a file of settings.
/// @throws Error{usage} for anything else, and for settings that are none of the studio
Wanted wanted_from(const std::string& json);

/// The words of its command line behind the program's name.
std::vector<std::string> words_of(const Wanted& wanted, const std::string& mesh);
/// As parsed from them.
Options options_of(const Wanted& wanted, const std::string& mesh);
/// As people write it.
std::string command_line(const Wanted& wanted, const std::string& mesh);
/// As --save-config writes it.
nlohmann::ordered_json config_of(const Wanted& wanted, const std::string& mesh);

/// Of each goal its name, words, and the rows that set it.
nlohmann::ordered_json goals_json();

/// The settings of these options with their values, as texts.
nlohmann::ordered_json values_json(const Options& options);

}  // namespace rayrep::tool
