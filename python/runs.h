#pragma once

#include <optional>
#include <string>
#include <vector>

#include "options.h"
#include "rayrep/rayrep.h"

namespace rayrep::python {

/// A mesh in mm, and what is known of where it came from.
struct Body {
  Mesh mesh;
  std::string name = {};                    ///< the path it was read from; empty: made of arrays
  std::vector<Part> modifiers = {};         ///< of 3MF
  std::optional<InputSummary> source = {};  ///< of one that was read: it has been checked
};

/// A command and its options in the command line's words: "float", "--wall=0.8"; without the mesh.
using Words = std::vector<std::string>;

/// What a run takes that is in memory, beside what its words name by path.
struct Given {
  std::optional<Body> body;      ///< none: the words name it, --input=PATH
  std::optional<Body> original;  ///< likewise, --original=PATH
  std::vector<Part> fixed = {};
  std::vector<Mesh> deform_fixed = {};
};

/// What a run came to.
struct Outcome {
  RunReport report;
  Spec spec;                   ///< what it was held to, with what a maker found
  Mesh given = {};             ///< the solid, or of a verify run the original; may be empty
  Mesh outside = {};           ///< that was changed; empty: it was not
  Delivery made = {};          ///< as it is written; empty of a verify run
  Delivery judged = {};        ///< as it was read back
  std::string gcode = {};      ///< of a slicer
  std::string stored_as = {};  ///< ending of the file it was judged in: ".stl"
  ThreeMfFlavor flavor = ThreeMfFlavor::prusa;
};

/// A command's options as they are before anything is given, and their rows. @throws Error{usage} for a word or goal there is not
struct Defaults {
  tool::Options options;
  const tool::Syntax* syntax = nullptr;
  std::vector<tool::Group> groups() { return tool::groups_of(*syntax, options); }  ///< bound to `options`
};
/// @param goal  of verify
Defaults defaults_of(const std::string& word, const std::string& goal);

/// Reads a mesh, checks it and mends what needs no guess; words of `inspect`. One that is not closed comes back, too.
/// @throws Error{input} for a file that cannot be read
Body load(const Words& words, const Progress& progress);
/// The same of a mesh in memory.
Body checked(const Body& body, const CheckOptions& check, const Progress& progress);

/// Makes the inside, stores it in a temporary file, reads that back and has it judged: what the command does, without its files.
/// One that fails is an outcome. With --allow the least change is made that does. @throws Error
Outcome hollow(const Words& words, const Given& given, const Progress& progress);
/// What would do instead. @throws Error
Advice advise(const Words& words, const Given& given, const Progress& progress);
/// Of a mesh, or with an original of a file for a printer. @throws Error
Outcome verify(const Words& words, const Given& given, const Progress& progress);
/// Of a file for a printer, --of=PATH or Given::original the mesh in it. @throws Error
Measurement measure(const Words& words, const Given& given, const Progress& progress);

/// What a mesh is, without a goal; `mass` is none where it is not closed.
struct Looked {
  InputSummary input;
  double density_g_cm3 = 0;
  double area_mm2 = 0;
  std::optional<MassProperties> mass;
  Inspection inspection() const { return {input, density_g_cm3, area_mm2, mass ? &*mass : nullptr}; }
};
Looked inspect(const Words& words, const Given& given, const Progress& progress);

/// A figure of an outcome, ".svg" or ".png". @param plane  "y=0": a section; empty: before and after, cut open
std::string picture(const Outcome& outcome, const std::string& ending, const std::string& plane, const Progress& progress);

/// Writes what was made, all of it or nothing.
/// @throws Error{usage} for an ending that does not hold what was judged; Error{write}
void export_to(const std::filesystem::path& path, const Outcome& outcome);

/// A setting that says what a maker found, as `verify` takes it.
struct Found {
  std::string name;
  std::variant<double, bool, std::string> value;
};
/// What a verdict was held to, as far as it differs from what `verify` takes by itself.
std::vector<Found> judged_by(const Outcome& outcome);

}  // namespace rayrep::python
