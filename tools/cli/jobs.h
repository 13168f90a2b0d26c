#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace rayrep::tool {

/// A run of the command, as a line of JSON has it: {"id": "thin", "command": "float", "mesh": "duck.stl", "options": {"wall":
/// 0.8}}.
struct Job {
  std::string id;  ///< names its files: letters, digits, dots, dashes and underscores; no two alike
  std::string command;
  std::string mesh;
  std::vector<std::pair<std::string, std::string>> options;  ///< without dashes; "" of a switch; may be given several times

  /// Of the command line, without the program.
  std::vector<std::string> words() const;
};

/// A job as a line of JSON, without its end.
std::string to_line(const Job& job);

/// Jobs from lines of JSON; empty lines are none. One without an id gets one from its mesh and its line.
/// @throws Error{input} with the line, and what is wrong there
std::vector<Job> read_jobs(const std::filesystem::path& path);

/// One option and the values it takes in turn.
struct Varied {
  std::string name;
  std::vector<std::string> values;
};
/// "wall=0.8,1.2", "up=0,1,1|0,0,1", where values hold commas, or "size=60..100/5": so many of them, evenly.
/// @throws Error{usage}
Varied parse_varied(const std::string& text);

/// The study of all combinations: each mesh with each value of the first, of the second ...
std::vector<Job> sweep(const Job& first, const std::vector<std::string>& meshes, const std::vector<Varied>& varied);

}  // namespace rayrep::tool
