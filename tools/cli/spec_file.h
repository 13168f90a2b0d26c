#pragma once

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "rayrep/base/setting.h"

namespace rayrep::tool {

/// A setting's value in JSON as the texts that a command line would have for it: a number or a text is one, so are a list of
/// numbers (a point) and an object (names with numbers); of a setting that may be given several times any other list is so many.
/// None: it is none of these.
std::optional<std::vector<std::string>> setting_texts(const nlohmann::json& value, bool repeated);

/// The other way round: true of an empty text, a number where it reads as the same text again.
nlohmann::ordered_json setting_json(const std::string& text);

/// Settings from a JSON file, as the texts that a command line would have for them.
struct SpecFile {
  struct Entry {
    std::vector<std::string> texts;  ///< one for each time it is given; of a switch one that is empty
    int line = 0;
  };
  std::filesystem::path path;
  std::map<std::string, Entry> entries;  ///< by the settings' names; the mesh under "mesh"

  /// "FILE, line 3: ".
  std::string place(const std::string& name) const;
};

/// Reads an object whose names are those of the settings: numbers, texts, true for a switch; a list of numbers for a point, a list
/// of such values where a setting may be given several times; an object for a list of names with numbers. What says null or false
/// is not given. Files that it names lie beside it.
/// @param known  by their long names. @throws Error{usage} with the line, Error{input} when it cannot be read
SpecFile read_spec_file(const std::filesystem::path& path, const Settings& known);

/// The text of such a file. @param path  where it will be: files that it names are told from there
std::string spec_file_text(const std::map<std::string, std::vector<std::string>>& said, const std::filesystem::path& path);

}  // namespace rayrep::tool
