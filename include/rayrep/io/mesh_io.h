#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "rayrep/mesh/mesh.h"

namespace rayrep {

enum class LengthUnit { millimetre, centimetre, metre, inch };

/// mm per unit: 1, 10, 1000, 25.4.
double millimetres(LengthUnit unit);

/// "mm", "cm", "m" or "in". @throws Error{usage} otherwise.
LengthUnit parse_length_unit(const std::string& text);

struct ReadOptions {
  LengthUnit unit = LengthUnit::millimetre;  ///< what one file unit means; a 3MF file's own unit wins
};

/// A mesh as it stands in a file, scaled to millimetres, otherwise untouched: corners are not merged, nothing is dropped.
struct MeshFile {
  Mesh mesh;
  std::string format;              ///< "STL binary", "STL ASCII", "OBJ", "PLY ASCII", "PLY binary", "OFF", "3MF"
  double mm_per_unit = 1;          ///< the factor that was applied: 3MF's own unit, else ReadOptions::unit
  std::size_t polygons = 0;        ///< faces in the file; fewer than triangles when some were quads or larger
  std::vector<std::string> notes;  ///< things a user should know, such as ignored trailing bytes
};

/// Reads STL (binary, also when its header begins with "solid"; ASCII), OBJ (polygons, negative indices, groups), PLY
/// (ASCII, binary of both endiannesses), OFF and 3MF (unit, components, build transforms, several objects). The kind is
/// taken from the content where it has a magic number, else from the ending of the name, in any case.
/// Polygons become fans, or ears where they are concave.
/// @throws Error{input} naming the file, the line, byte or face, and what to do.
MeshFile read_mesh(const std::filesystem::path& path, const ReadOptions& options = {});

/// Kinds that can be written, by the ending of the name: .stl (binary), .obj, .ply (binary), .3mf (in any case).
bool can_write(const std::filesystem::path& path);

/// Writes to a temporary file in the same folder, then renames: an existing file survives any failure.
/// STL stores float32; OBJ and 3MF enough digits to restore every double; PLY doubles.
/// 3MF is one core object in millimetres, cavities as reversed shells of the same mesh, with PrusaSlicer's
/// `fill_density=100%` as object metadata, which overrides the user's profile there.
/// @throws Error{write} with the system's reason, or for a mesh without triangles or with a coordinate that is not finite
/// as stored; Error{usage} for an ending that cannot be written.
void write_mesh(const std::filesystem::path& path, const Mesh& mesh);

/// The coordinates that reading a mesh back from `path` will give: rounded to float32 for .stl, otherwise unchanged.
Mesh as_stored(const std::filesystem::path& path, const Mesh& mesh);

/// Writes text through the same temporary-file-and-rename path. @throws Error{write}
void write_text_file(const std::filesystem::path& path, const std::string& text);

}  // namespace rayrep
