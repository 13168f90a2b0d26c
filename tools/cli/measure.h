#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "options.h"
#include "rayrep/rayrep.h"

namespace rayrep::tool {

/// What the file for a printer that is the input lays down. Its density is the one on the command line, else the file's, else that
/// of Print.
/// @param mesh       where it is looked for; may be null
/// @param mesh_name  its path, for the report
Measurement measured(const Options& options, const Mesh* mesh, const std::string& mesh_name);

/// What a file that is written holds: its mesh and, of 3MF, where it is printed sparsely.
Delivery delivery_of(MeshFile file, const std::optional<double>& percent_laid_down);

/// Whether bodies that overlap, and were made one in an original, stand in what is judged by it as they were.
bool overlaps_stand(const CheckedMesh& original, const Mesh& judged, const Progress& progress);

using Notes = std::vector<std::string>;

/// A closed mesh beside the one that is worked on. @throws Error{input}
/// @param notes  gets what first aid did to it, with its path; null: nobody asks
Mesh read_closed(const std::filesystem::path& path, const Options& options, const Progress& progress, Notes* notes = nullptr);

/// Regions that stay solid, and bodies that are not printed. @throws Error{input} for one that is not closed
std::vector<Mesh> read_kept_solid(const Options& options, const Progress& progress, Notes* notes = nullptr);
std::vector<Part> read_fixed(const Options& options, const Progress& progress, Notes* notes = nullptr);

/// What is looked at, and by what it is told from what it was.
struct Kept {
  const Options& options;
  const Delivery& delivered;
  const Mesh* original;
  Notes* notes = nullptr;
};

/// Adds to a verdict what regions that were to stay solid have to do with it. @throws Error{input}: see read_kept_solid
void judge_kept(const Kept& what, const Spec& spec, Verdict& verdict, const Progress& progress);

/// What closes holes, as it was written. @throws Error{input}
std::vector<Part> read_plugs(const std::filesystem::path& path);

/// Judges a print with what is put into it and the plugs that close it; what nobody can tell of a print is among its notes.
Verdict verify_print_with(const Delivery& put_in, const Mesh& original, const Measurement& print, const Spec& spec,
                          const Progress& progress);

/// What is printed of one body after the other: as a slicer lays it down, its G-code in a temporary folder; or as it is expected
/// after what was sliced by hand (Options::as_sliced), with as much more than the mesh as that had.
class SlicedBodies {
public:
  /// Keeps references.
  SlicedBodies(const Options& options, const Progress& progress);

  /// Of the next body. @returns moments of what is laid down, in its frame
  Moments slice(const Delivery& delivery);

  /// Judges what is delivered and its G-code as they stand on the disk, and fills in RunReport::print; or what is delivered as it
  /// is expected to be printed.
  Verdict judged(const Delivery& delivered, const Mesh& original, RunReport& report, const Progress& progress) const;

  /// Writes a slicer's G-code of the n-th body to its place. @throws Error{write}
  void deliver(std::size_t n) const;

private:
  bool by_hand() const { return !options_.as_sliced.empty(); }
  std::filesystem::path gcode(std::size_t n) const;

  const Options& options_;
  const Progress& progress_;
  std::optional<TemporaryFolder> folder_;  ///< none: by hand
  std::size_t count_ = 0;
  Moments excess_ = Moments::Zero();  ///< by hand: of the print over its mesh
};

}  // namespace rayrep::tool
