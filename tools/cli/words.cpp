// Help, man page and completion, from the rows of the options.

#include <algorithm>
#include <set>

#include "options.h"
#include "rayrep/report/report.h"

namespace rayrep::tool {
namespace {

constexpr std::size_t kWidth = 100;

/// "-o [ --output ] FILE (=x)"
std::string option_words(const Setting& s, const std::string& usual) {
  const auto comma = s.name.find(',');
  std::string text =
      comma == std::string::npos ? "--" + s.name : "-" + s.name.substr(comma + 1) + " [ --" + s.name.substr(0, comma) + " ]";
  if (!s.value.empty()) text += s.alone.empty() ? " " + s.value : " [" + s.value + "]";
  return text + usual;
}

/// The usual value, where it says something.
std::string usual_value(const Setting& s) {
  static const std::set<std::string> kToldInWords = {"density", "material", "threads", "max-tilt", "goal", "port"};
  if (s.value.empty() || kToldInWords.contains(s.name) || std::holds_alternative<std::optional<double>*>(s.place)) return "";
  const std::string value = shown(s);
  return value == "none" || value == "auto" || value == "free" ? "" : " (=" + value + ")";
}

/// Words from column `column` on, broken before the width of a terminal.
std::string wrapped(const std::string& text, std::size_t column) {
  std::string out;
  std::size_t at = column;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find(' ', begin), text.size());
    if (at > column && at + (end - begin) > kWidth) {
      out.back() = '\n';  // for the blank before it
      out += std::string(column, ' ');
      at = column;
    }
    out += text.substr(begin, end - begin) + (end < text.size() ? " " : "");
    at += end - begin + 1;
    begin = end + 1;
  }
  return out;
}

/// Groups with live options behind them: of verify those of every goal, each option once.
class Everything {
public:
  explicit Everything(const Syntax& syntax) {
    const bool all = syntax.command == Command::verify;
    const std::vector<Options> every = all ? defaults_of_all_goals(syntax) : std::vector{defaults_of(syntax)};
    options_.reserve(every.size());
    std::set<std::string> names;
    for (const Options& one : every) {
      options_.push_back(one);
      for (Group& group : groups_of(syntax, options_.back())) {
        std::erase_if(group.settings, [&names](const Setting& s) { return !names.insert(s.name).second; });
        if (!group.settings.empty()) groups.push_back(std::move(group));
      }
    }
    std::stable_partition(groups.begin(), groups.end(), [](const Group& group) { return group.heading != "Files"; });
  }
  Everything(const Everything&) = delete;
  Everything& operator=(const Everything&) = delete;

  std::vector<Group> groups;

private:
  std::vector<Options> options_;
};

std::string roff(const std::string& text) {
  std::string out;
  for (const char c : text) out += c == '-' ? "\\-" : c == '\\' ? "\\\\" : std::string(1, c);
  return out;
}

std::string man_options(const Syntax& syntax) {
  std::string text;
  const Everything everything(syntax);
  for (const Group& group : everything.groups) {
    text += ".SS rayrep " + syntax.word + ": " + roff(group.heading) + "\n";
    for (const Setting& s : group.settings) {
      text += ".TP\n.B " + roff(option_words(s, usual_value(s))) + "\n";
      std::string words = s.words;
      words[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(words[0])));
      text += roff(words) + ".\n";
      if (!s.details.empty()) text += roff(s.details) + "\n";
    }
  }
  return text;
}

constexpr const char* kDescription = R"(.SH DESCRIPTION
The output of a command that hollows is the untouched outer surface and closed, inward\-facing cavity shells, in the input's own
coordinates, to be printed solid. It is re\-read from disk and judged before it gets its name.
.PP
.B float
weighs what it displaces, its centre of mass on one vertical with its centre of buoyancy and as low as possible.
.B spin
brings the centre of mass onto the spin axis and makes that a principal axis, of the largest moment of inertia, and tells at which speeds
the spin is stable, for a tip that slides and for one that is held by friction.
.B stand
brings the centre of mass above a point of the support polygon, as low as possible, and tells the tipping angle of each edge.
.B target
meets any of mass, centre of mass and inertia; what is free is made as small as it goes in a stated order. Goals that cannot be met are
refused with the figures and with what would help.
.PP
.B verify
judges any mesh by the checks that the other commands make on what they deliver. What it judges by must be the same as when the mesh was
made:
.B \-\-verbose
prints the command line that judges an output again.
.PP
.B studio
serves a page on 127.0.0.1 and opens it in the browser: drop a mesh, choose a goal, drag what it shall do; a quick answer follows the hand,
and a full run is judged before it can be downloaded. Only who has the address that is printed may ask, and nothing is written but what is
downloaded.
.PP
.I MESH
is STL, OBJ, PLY, OFF or 3MF. It must be closed; what is wrong with one that is not is counted, located and said. Overlapping closed
components are a union. Results go to standard output; progress and errors to standard error. Progress is shown on a terminal only.
)";

constexpr const char* kEnding = R"(.SH EXIT STATUS
.TP
.B 0
Done; every criterion is met by the mesh that was written or judged.
.TP
.B 1
Out of memory, which is said, or a defect of rayrep.
.TP
.B 2
The command line makes no sense.
.TP
.B 3
The mesh cannot be read or used.
.TP
.B 4
The goal cannot be met, or the judged mesh does not meet it, with the numbers that say why. No mesh is written.
.TP
.B 5
The solver stopped before it converged.
.TP
.B 6
An output cannot be written; the message says so when it is only standard output, and the mesh is in its place.
.TP
.B 130, 143, 129
Interrupted by SIGINT, SIGTERM or SIGHUP, within a second. Nothing is left behind, and what stood in the output's place still does.
.SH ENVIRONMENT
.TP
.B NO_COLOR
Set to anything: progress on a terminal is told without bold letters.
.TP
.B TERM
Unset or dumb: as if standard error were no terminal.
.SH EXAMPLES
.TP
.B rayrep float examples/duck.stl \-\-fluid 1.0
A duck that floats in fresh water at the waterline where it is most stable.
.TP
.B rayrep float boat.obj \-\-up y \-\-size 80 \-\-material petg \-o boat.3mf
A model whose up is y, 80 mm long, in PETG.
.TP
.B rayrep spin examples/bird.stl \-\-point com
A top about the vertical through the solid's centre of mass.
.TP
.B rayrep spin examples/heart.stl \-\-yoyo \-\-up y
A yo\-yo with its axis along y.
.TP
.B rayrep stand examples/teapot.stl \-\-objective tip\-angle
A teapot that is hardest to tip over.
.TP
.B rayrep target part.stl \-\-mass 50 \-\-com 0,0,\- \-\-minimise com_z \-\-urdf part.urdf
A part of 50 g with its centre of mass on the z axis, as low as it goes, and the text for a robot's description.
.TP
.B rayrep verify bird_spin.stl \-\-goal spin \-\-original examples/bird.stl
Does this top spin on its lowest point, and is it the bird outside?
.TP
.B rayrep float examples/duck.stl \-\-section y \-\-section z=10:plan.png \-\-picture duck.png
Pictures as well: a section through the centre of mass, one at a height, and before and after, cut open.
.SH NOTES
Print the result solid (100 % infill), with supports on the build plate only: a mesh with a cavity, printed at 15 % infill, has another
mass, and automatic supports fill the cavity. A 3MF output asks PrusaSlicer, Bambu Studio and OrcaSlicer for both; other slicers and
formats have to be told.
.PP
The print is taken to be uniform and of the given density. Slicers put down 0.5 to 1.5 % more than the mesh's volume. What floats must
therefore still rest upright with 1 % more plastic everywhere
.RB ( reserve ),
and a note tells if it does not with 3 %.
.PP
A cavity is sealed and has no drain hole. With
.B \-\-material resin
what stays in it uncured is weighed, and the mesh is refused
.RB ( trapped_resin )
unless
.B \-\-drained
says that you will drain it and close it again. The powder that a powder printer leaves is not accounted for.
.PP
Outputs are written to a hidden file beside their place
.RI ( .rayrep\-PID\-N )
and get their name at the end. A run that was killed leaves its hidden file; a later run of the same user with an output in that folder
removes it when it is older than an hour and the process is gone. A report, and texts for simulators, may go to a device, a pipe,
.I /dev/stdout
or
.IR /dev/fd/N ;
a mesh may not, as it is read back.
.SH SEE ALSO
docs/conventions.md and docs/theory.md in the source.
)";

}  // namespace

std::string overview() {
  std::string text =
      "rayrep computes the inside of a 3D shape so that its print floats upright, spins, stands or has\n"
      "the mass, centre of mass and inertia that you want.\n\n";
  for (const Syntax& syntax : commands()) {
    const std::string call = "  rayrep " + syntax.word + " " + syntax.takes;
    text += call + std::string(24 - call.size(), ' ') + syntax.one_line + "\n";
  }
  return text +
         "\n"
         "  rayrep COMMAND --help lists the options of a command.\n"
         "  rayrep --version; --man prints the man page (rayrep --man | man -l -); --completion that of bash.\n"
         "\n"
         "Reads STL, OBJ, PLY, OFF and 3MF; writes STL, OBJ, PLY and 3MF.\n"
         "Exit codes: 0 done and verified, 2 usage, 3 input cannot be used, 4 goal cannot be\n"
         "met, 5 solver stopped, 6 cannot write, 130 interrupted (143 by SIGTERM, 129 by\n"
         "SIGHUP), 1 out of memory or internal error.\n";
}

std::string help_text(const Syntax& syntax) {
  std::string text = syntax.headline;
  constexpr std::size_t column = 34;
  const Everything everything(syntax);
  std::string rare;
  for (const Group& group : everything.groups) {
    // The goals that verify may judge by are told close together: its help fits a screen.
    if (!std::all_of(group.settings.begin(), group.settings.end(), [](const Setting& s) { return s.rare; }))
      text += (group.heading.rfind("Goal ", 0) == 0 ? "" : "\n") + group.heading + ":\n";
    for (const Setting& s : group.settings) {
      if (s.rare) {
        rare += " --" + s.name;
        continue;
      }
      std::string line = "  " + option_words(s, usual_value(s));
      line += line.size() + 1 < column ? std::string(column - line.size(), ' ') : "\n" + std::string(column, ' ');
      text += line + wrapped(s.words, column) + "\n";
    }
  }
  if (!rare.empty()) text += "\nAnd, told by the man page:\n  " + wrapped(rare.substr(1), 2) + "\n";
  return text;
}

std::string man_page() {
  std::string text = ".TH RAYREP 1 2026 \"rayrep " + version() +
                     "\" \"User Commands\"\n.SH NAME\nrayrep \\- hollow a mesh so that the printed object floats upright, spins, "
                     "stands, falls as a die, or has a given "
                     "mass and inertia\n.SH SYNOPSIS\n";
  for (const Syntax& syntax : commands()) text += ".B rayrep " + syntax.word + "\n.I " + syntax.takes + "\n.RI [ options ]\n.br\n";
  text += kDescription;
  text += ".SH OPTIONS\n";
  for (const Syntax& syntax : commands()) text += man_options(syntax);
  return text + kEnding;
}

std::string bash_completion() {
  std::string words;
  std::string cases;
  for (const Syntax& syntax : commands()) {
    words += " " + syntax.word;
    std::set<std::string> names;
    const Everything everything(syntax);
    for (const Group& group : everything.groups)
      for (const Setting& s : group.settings) names.insert("--" + s.name.substr(0, s.name.find(',')));
    cases += "    " + syntax.word + ") words=\"";
    for (const std::string& name : names) cases += name + " ";
    cases.back() = '"';
    cases += " ;;\n";
  }
  std::string actions;
  for (const std::string& action : scene_actions()) actions += (actions.empty() ? "" : " ") + action;
  return "# eval \"$(rayrep --completion)\"\n_rayrep() {\n  local word=${COMP_WORDS[COMP_CWORD]} words=\n  if [ \"$COMP_CWORD\" "
         "-eq 1 ]; then\n    words=\"" +
         words.substr(1) + " --help --version\"\n  else case ${COMP_WORDS[1]} in\n" + cases +
         "  esac; fi\n  case $word in\n    -*) ;;\n    *) [ \"$COMP_CWORD\" -eq 1 ] || words=\n"
         "       [ \"$COMP_CWORD ${COMP_WORDS[1]}\" = '2 scene' ] && words=\"" +
         actions +
         "\" ;;\n  esac\n"
         "  mapfile -t COMPREPLY < <(compgen -W \"$words\" -- \"$word\")\n}\ncomplete -o default -F _rayrep rayrep\n";
}

}  // namespace rayrep::tool
