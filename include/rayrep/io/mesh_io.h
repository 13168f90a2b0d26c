#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "rayrep/io/write_file.h"
#include "rayrep/mesh/delivery.h"
#include "rayrep/mesh/mesh.h"

namespace rayrep {

enum class LengthUnit { millimetre, centimetre, metre, inch };

/// mm per unit: 1, 10, 1000, 25.4.
double millimetres(LengthUnit unit);

/// "mm", "cm", "m" or "in". @throws Error{usage} otherwise.
LengthUnit parse_length_unit(const std::string& text);

struct ReadOptions {
  LengthUnit unit = LengthUnit::millimetre;  ///< what one file unit means; a 3MF file's own unit wins
  /// Bounds the file itself and what a 3MF archive unpacks to, with what is made of it. Other kinds take up to five times their
  /// size.
  std::size_t memory_bytes = 2'000'000'000;
};

/// A mesh as it stands in a file, scaled to millimetres, otherwise untouched: corners are not merged, nothing is dropped.
struct MeshFile {
  Mesh mesh;
  std::string format;              ///< "STL binary", "STL ASCII", "OBJ", "PLY ASCII", "PLY binary", "OFF", "3MF"
  double mm_per_unit = 1;          ///< the factor that was applied: 3MF's own unit, else ReadOptions::unit
  std::size_t polygons = 0;        ///< faces in the file; fewer than triangles when some were quads or larger
  std::vector<std::string> notes;  ///< things a user should know, such as ignored trailing bytes
  /// Of 3MF: modifiers with an infill of their own, not in `mesh`; the share is taken to be what the slicer calls it.
  std::vector<Part> modifiers = {};
  /// Of a 3MF file with a body in pieces, as write_delivery writes it: each where it is in the whole, with its place on the bed.
  /// `mesh` is then what they are together.
  std::vector<Part> pieces = {};
  std::vector<Part> inserts = {};  ///< what is put into such a body
};

/// Reads STL (binary, also when its header begins with "solid"; ASCII), OBJ (polygons, negative indices, groups), PLY
/// (ASCII, binary of both endiannesses, triangle strips), OFF and 3MF (unit, components, build transforms, several objects). The
/// kind is taken from the content where it tells, else from the ending of the name, in any case.
/// Polygons become fans, or ears where they are concave; what that makes of faces that are not flat does not depend on the corner
/// they start with, and is noted.
/// What a 3MF file marks as no material is left out: modifiers (see MeshFile::modifiers), support blockers and enforcers of
/// PrusaSlicer, Bambu Studio and OrcaSlicer, objects of type "support", "solidsupport", "other" or "surface". Negative volumes are
/// subtracted from the build item they belong to. Both are noted. Objects whose shape is not only triangles (slices, beam lattices,
/// booleans) are refused.
/// @throws Error{input} naming the file, the line, byte or face, and what to do.
MeshFile read_mesh(const std::filesystem::path& path, const ReadOptions& options = {});

/// Kinds that can be written, by the ending of the name: .stl (binary), .obj, .ply (binary), .3mf (in any case).
bool can_write(const std::filesystem::path& path);

/// Writes as write_text_file does.
/// STL stores float32; OBJ and 3MF enough digits to restore every double; PLY doubles.
/// 3MF is one core object in millimetres, cavities as reversed shells of the same mesh. Settings of the object override the user's
/// profile: 100 % infill, and supports from the build plate only, so that none fill a cavity. For PrusaSlicer `fill_density`,
/// `fill_pattern` and `support_material_buildplate_only`; for Bambu Studio and OrcaSlicer `sparse_infill_density` and
/// `support_on_build_plate_only`.
/// @throws Error{write} with the system's reason, or for a mesh without triangles or with a coordinate that is not finite
/// as stored; Error{usage} for an ending that cannot be written.
void write_mesh(const std::filesystem::path& path, const Mesh& mesh);

/// Kinds that can hold where to print sparsely: .3mf.
bool can_write_infill(const std::filesystem::path& path);

/// Writes the parts as one object, sparse regions as modifiers with their infill and without solid layers of their own; 3MF also
/// with pauses, for PrusaSlicer. Inserts are not written, but for those of a body in pieces: its pieces are objects that lie on
/// the bed side by side, and what is put in is an object that is not built.
/// @throws Error as write_mesh; Error{usage} for sparse regions or pieces in a file that is not 3MF
void write_delivery(const std::filesystem::path& path, const Delivery& delivery, ThreeMfFlavor flavor = ThreeMfFlavor::prusa);

/// The coordinates that reading a mesh back from `path` will give: rounded to float32 for .stl, otherwise unchanged.
Mesh as_stored(const std::filesystem::path& path, const Mesh& mesh);

}  // namespace rayrep
