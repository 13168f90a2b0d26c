#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "jobs.h"
#include "rayrep/advice/suggest.h"
#include "rayrep/base/setting.h"
#include "rayrep/draw/section_picture.h"
#include "rayrep/io/mesh_io.h"
#include "rayrep/io/printed.h"
#include "rayrep/make/hollow.h"
#include "rayrep/physics/spec.h"
#include "rayrep/print/place_print.h"
#include "rayrep/print/slicer.h"
#include "rayrep/shape/deform.h"

namespace rayrep::tool {

enum class Command { hollow, verify, inspect, measure, view, batch, sweep, studio, scene, motion, carve, balance, text };

/// A file with a body that is not printed.
struct FixedFile {
  std::filesystem::path path;
  double density_g_cm3 = 0;
};

/// How the jobs of a file are run.
struct BatchOptions {
  std::filesystem::path folder;  ///< gets what they write
  std::size_t shard = 1;         ///< of
  std::size_t shards = 1;        ///< only each n-th job is run
  int at_once = 0;               ///< 0: as many as there are cores
  int threads_each = 1;
  std::optional<double> time_limit_s;  ///< of a job
  std::string ending;                  ///< of meshes: ".3mf"; empty: the usual one
  bool retry = false;                  ///< what crashed or took too long
  std::filesystem::path summary;       ///< a table, CSV; empty: none
};

/// How the page of studio is served.
struct StudioOptions {
  int port = 0;  ///< of 127.0.0.1; 0: any that is free
  bool no_open = false;
  std::size_t most_upload_bytes = 256'000'000;
};

/// Of what takes a scene in place of a mesh.
struct SceneOptions {
  std::string action = "check";        ///< of scene: check, import or export
  double tolerance = 1e-3;             ///< of times, a share of a transition
  std::optional<double> clearance_mm;  ///< none: the scene's
  std::string part, by;                ///< carve: of what, and what makes its way through it
  double carve_tolerance_mm = 0.2;     ///< how much more may be taken away than has to be
  bool visual = false;                 ///< scene import: links are as they are seen, not as they collide
  bool as_is = false;                  ///< balance: judge the parts as they are
  bool hint = false;                   ///< motion: tell what moves out of the way
  bool resolve = false;                ///< and do so
  std::vector<std::string> free;       ///< what may be moved then; empty: everything
};

/// A section that is drawn.
struct SectionFile {
  SectionPlane plane;
  std::filesystem::path path;
};

/// The command line, parsed and checked as far as that is possible without the mesh.
struct Options {
  Command command = Command::text;
  std::string word;  ///< as it was given: "float", "verify", ...
  std::string text;  ///< of Command::text: help, version, man page, completion

  std::filesystem::path input;
  std::filesystem::path spec_file;                        ///< of settings that the command line does not have; empty: none
  std::filesystem::path saved_config;                     ///< gets what was said; empty: none
  std::string config;                                     ///< that
  std::size_t memory_bytes = ReadOptions{}.memory_bytes;  ///< to read a mesh
  LengthUnit unit = LengthUnit::millimetre;
  std::optional<double> size_mm;  ///< longest side
  bool repair = false;            ///< first aid closes holes, too, whose shape has to be guessed
  bool rigid = false;             ///< bodies that do not touch are held together by something
  bool each = false;              ///< bodies that do not touch are treated one by one

  std::string goal = "float";                     ///< hollow, verify: one of the goals' words
  Spec spec;                                      ///< hollow, verify: what MESH is, or shall be, for
  Print print;                                    ///< inspect, measure
  bool density_given = false;                     ///< by --density or --material
  BatchOptions batch;                             ///< batch
  StudioOptions studio;                           ///< studio
  SceneOptions scene;                             ///< scene, motion, carve, balance
  std::vector<Job> sweep;                         ///< sweep: what it writes
  std::vector<std::string> vary;                  ///< and of what: NAME=VALUES
  PrintedOptions printed;                         ///< of a file for a printer: how it is read,
  PlacePrintOptions placing;                      ///< and how the mesh lies in it, but for
  double turned_deg = 0;                          ///< by which it is turned on the bed
  std::vector<FixedFile> fixed;                   ///< hollow, verify: in mm, in the place where they are in the body
  std::vector<std::filesystem::path> keep_solid;  ///< likewise: closed meshes in which there shall be no cavity
  HollowOptions hollow;
  DeformOptions deform;                             ///< without a limit the outside stays as it is
  std::vector<std::filesystem::path> deform_fixed;  ///< meshes, in mm, where they are in the body: what lies in them does not move

  SlicerOptions slicer;                   ///< hollow: no program: the mesh alone
  std::filesystem::path gcode;            ///< of the slicer; empty: the output's name
  std::filesystem::path as_sliced;        ///< G-code of
  std::filesystem::path sliced_mesh;      ///< what this command made before; both or neither
  std::optional<double> measured_mass_g;  ///< of a print, by a scale: tells the density

  std::filesystem::path output;                       ///< empty: the default name
  std::filesystem::path insert_output;                ///< of a heavy core or balls; empty: there are none
  std::filesystem::path plug_output;                  ///< of what closes holes again; empty: none, or with the body
  std::filesystem::path outside_output;               ///< where the outside may be deformed
  bool phases = false;                                ///< of infill: write what is dense and what is sparse as meshes, too:
  std::filesystem::path dense_output, sparse_output;  ///< empty: they are not written
  std::filesystem::path piece_output;                 ///< empty: likewise; else NAME.stl, of which the first piece is NAME_1.stl
  ThreeMfFlavor flavor = ThreeMfFlavor::prusa;
  std::filesystem::path
      original;  ///< verify: the surface that must be unchanged; measure: where the print is looked for; may be empty
  std::filesystem::path plugs;   ///< verify: what closes holes again; empty: none, or with the body
  std::filesystem::path report;  ///< empty: none
  std::filesystem::path html;    ///< likewise
  std::filesystem::path urdf;    ///< target, inspect; empty: none
  std::filesystem::path mjcf;
  std::vector<SectionFile> sections;
  std::filesystem::path picture;                          ///< empty: none
  Eigen::Vector3d picture_up = Eigen::Vector3d::UnitZ();  ///< inspect, view
  /// The input is a scene, not a mesh.
  bool takes_scene() const {
    return command == Command::scene || command == Command::motion || command == Command::carve || command == Command::balance;
  }
  double insert_density() const;  ///< of what is in insert_output
  bool draws() const { return !sections.empty() || !picture.empty(); }
  std::filesystem::path output_of_piece(std::size_t number) const;  ///< counted from 1
  /// All meshes that are written; of pieces the first two.
  std::vector<std::filesystem::path> meshes() const;
  std::vector<ChangeKind> allow;               ///< which changes are made where it cannot be done as asked
  std::string changed;                         ///< what was changed so; empty: nothing
  std::shared_ptr<const Deformation> outside;  ///< what is to become of the outside, where that is known already
  bool attempt = false;                        ///< what does not do is not told
  bool suggest = false;                        ///< print command lines that would succeed when this one cannot
  bool no_advice = false;                      ///< do not look for them
  bool json = false;
  bool quiet = false;
  bool verbose = false;
  int threads = 0;  ///< 0: all cores

  std::vector<std::pair<std::string, std::string>> in_force;  ///< every option of the command with its value, for the report
};

/// Options that belong together, under a heading.
struct Group {
  std::string heading;
  Settings settings;
};

/// A command: its word, what it says of itself, and its options, bound to `options` (whose goal and spec they follow).
struct Syntax {
  std::string word;
  std::string headline;  ///< of its help
  std::string one_line;  ///< in the list of commands
  Command command;
  std::string takes = "MESH";  ///< there
};
/// What can be done with a scene: the word after "scene".
const std::vector<std::string>& scene_actions();

const std::vector<Syntax>& commands();
std::vector<Group> groups_of(const Syntax& syntax, Options& options);
/// Of a setting without the letter that is short for it.
std::string long_name(const Setting& setting);
/// Options as they are before anything is given.
Options defaults_of(const Syntax& syntax);
/// Of verify: those of every goal it judges by.
std::vector<Options> defaults_of_all_goals(const Syntax& syntax);

/// @throws Error{usage} that says what is wrong and how to get help
Options parse_command_line(int argc, const char* const* argv);

/// Whether what it makes is printed in pieces.
bool makes_pieces(const Options& options);

/// @throws Error{usage} when an output would overwrite what is read
void refuse_overwriting(const Options& options);
/// The same of a file that nobody knew of before the work: of the third piece and more.
void refuse_overwriting(const Options& options, const std::filesystem::path& output);

/// The words of a command line, the command's name first, with the options of a suggestion in place of their own.
std::vector<std::string> suggested(int argc, const char* const* argv, const Suggestion& suggestion);
/// They as one line for a shell.
std::string shell_line(const std::vector<std::string>& words);

/// The command line that judges `output` by what it was made for.
std::string judging_command(const Options& options, const Spec& spec, const std::string& output, bool with_original);

/// Of a file's name, with its dot, in lower case.
std::string ending_of(const std::filesystem::path& path);

/// As one word for a shell; control characters as bash's $'...' has them.
std::string quoted(const std::string& word);

/// With control characters but the ends of lines shown as \xNN: what is printed does nothing to a terminal, whatever a file
/// and its name hold.
std::string printable(const std::string& text);

/// Help, man page (roff) and completion (bash), from the same rows.
std::string overview();
std::string help_text(const Syntax& syntax);
std::string man_page();
std::string bash_completion();

}  // namespace rayrep::tool
