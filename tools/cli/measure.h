#pragma once

#include <filesystem>

#include "options.h"
#include "rayrep/rayrep.h"

namespace rayrep::tool {

/// What the file for a printer that is the input lays down. Its density is the one on the command line, else the file's, else that
/// of Print.
/// @param mesh       where it is looked for; may be null
/// @param mesh_name  its path, for the report
Measurement measured(const Options& options, const Mesh* mesh, const std::string& mesh_name);

/// The G-code of one body after the other, in a temporary folder.
class SlicedBodies {
public:
  /// Keeps references.
  SlicedBodies(const Options& options, const Progress& progress);
  ~SlicedBodies();
  SlicedBodies(const SlicedBodies&) = delete;
  SlicedBodies& operator=(const SlicedBodies&) = delete;

  /// Slices the next body. @returns moments of what is laid down, in its frame
  Moments slice(const Mesh& body);

  /// Judges a mesh and its G-code as they stand on the disk; fills in RunReport::print.
  Verdict judged(const Mesh& delivered, const Mesh& original, RunReport& report, const Progress& progress) const;

  /// Writes the G-code of the n-th body to its place. @throws Error{write}
  void deliver(std::size_t n) const;

private:
  std::filesystem::path gcode(std::size_t n) const;

  const Options& options_;
  const Progress& progress_;
  std::filesystem::path folder_;
  std::size_t count_ = 0;
};

}  // namespace rayrep::tool
