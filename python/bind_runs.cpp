#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <chrono>
#include <exception>

#include "bindings.h"

namespace py = pybind11;

namespace rayrep::python {
namespace {

/// How the time of a run is shared, in percent, as measured on the examples: tools/cli/stages.cpp.
struct Share {
  std::string_view stage;
  double percent;
};
constexpr Share kShares[] = {{"read", 1},  {"check", 2}, {"domain", 18}, {"rays", 5},   {"waterline", 17},
                             {"solve", 1}, {"mesh", 28}, {"write", 2},   {"verify", 26}};

/// What a computation that runs without the GIL and Python say to each other: stages and how much is done go to the callback,
/// which cancels by returning False or raising; signals are looked for, so that Ctrl-C raises KeyboardInterrupt.
class Talk {
public:
  explicit Talk(py::object callback) : callback_(std::move(callback)) {
    if (!callback_.is_none() && !PyCallable_Check(callback_.ptr())) throw py::type_error("progress must be callable, or None.");
  }

  Progress progress() {
    return {.stage = [this](std::string_view name) { begin(name); }, .cancelled = [this] { return is_cancelled(); }};
  }

  /// With the GIL: what Python has raised meanwhile goes on.
  void rethrow() const {
    if (raised_) std::rethrow_exception(raised_);
  }

  /// Stages and their seconds, then "total".
  std::vector<std::pair<std::string, double>> timings() {
    end();
    auto result = spent_;
    result.emplace_back("total", seconds(Clock::now() - born_));
    return result;
  }

  /// Tells that all is done. @throws py::error_already_set
  void done() {
    if (!callback_.is_none()) callback_("done", 1.0);
  }

private:
  using Clock = std::chrono::steady_clock;
  static double seconds(Clock::duration d) { return std::chrono::duration<double>(d).count(); }

  void begin(std::string_view name) {
    end();
    stage_ = name;
    began_ = Clock::now();
    double before = 0;
    for (const Share& share : kShares) {
      if (share.stage == name) share_ = std::max(share_, before / 100);
      before += share.percent;
    }
    tell();
  }

  void end() {
    if (stage_.empty()) return;
    const double took = seconds(Clock::now() - began_);
    for (auto& [name, spent] : spent_)
      if (name == stage_) {
        spent += took;
        return;
      }
    spent_.emplace_back(stage_, took);
  }

  void tell() {
    told_ = Clock::now();
    if (raised_ || cancelled_ || callback_.is_none()) return;
    const py::gil_scoped_acquire gil;
    try {
      const py::object answer = callback_(stage_, share_);
      cancelled_ = answer.ptr() == Py_False;
    } catch (...) {
      raised_ = std::current_exception();
    }
  }

  bool is_cancelled() {
    constexpr double kApart_s = 0.05;
    if (seconds(Clock::now() - looked_) > kApart_s) {
      look_for_signals();
      if (seconds(Clock::now() - told_) > 4 * kApart_s) tell();
    }
    return cancelled_ || raised_;
  }

  void look_for_signals() {
    looked_ = Clock::now();
    if (raised_) return;
    const py::gil_scoped_acquire gil;
    try {
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    } catch (...) {
      raised_ = std::current_exception();
    }
  }

  py::object callback_;
  std::string stage_;
  double share_ = 0;
  bool cancelled_ = false;
  std::exception_ptr raised_;
  std::vector<std::pair<std::string, double>> spent_;
  Clock::time_point born_ = Clock::now();
  Clock::time_point began_;
  Clock::time_point told_;
  Clock::time_point looked_ = born_;
};

/// Runs work without the GIL; what Python raises in between comes out unchanged.
template <typename Work>
auto without_gil(Talk& talk, const Work& work) {
  try {
    const py::gil_scoped_release release;
    return work(talk.progress());
  } catch (const Error& error) {
    if (error.code() == ErrorCode::interrupted) talk.rethrow();
    throw;
  }
}

/// Mesh and density, or a mesh alone.
using FixedMesh = std::pair<Body, double>;

Given given_of(const std::optional<Body>& body, const std::optional<Body>& original, const std::vector<FixedMesh>& fixed,
               const std::vector<Body>& deform_fixed) {
  Given given{body, original};
  for (const auto& [part, density] : fixed)
    given.fixed.push_back({.mesh = part.mesh, .role = Part::Role::insert, .density_g_cm3 = density});
  for (const Body& region : deform_fixed) given.deform_fixed.push_back(region.mesh);
  return given;
}

struct ToPython {
  py::object operator()(std::monostate) const { return py::none(); }
  py::object operator()(double value) const {
    return std::isfinite(value) ? py::object(py::float_(value)) : py::object(py::none());
  }
  py::object operator()(bool value) const { return py::bool_(value); }
  py::object operator()(const std::string& text) const { return str_of(text); }
  py::object operator()(const std::vector<double>& values) const { return array_of(values); }
  py::object operator()(const std::vector<std::vector<double>>& rows) const {
    const bool square = rows.size() == 3 && rows[0].size() == 3 && rows[1].size() == 3 && rows[2].size() == 3;
    if (!square) return list_of(rows);
    Eigen::Matrix3d m;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) m(i, j) = rows[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)];
    return array_of(m);
  }
  py::object operator()(const std::vector<Record>& records) const { return list_of(records); }
  py::object operator()(const Record& record) const {
    py::dict dict;
    for (const auto& [name, value] : record) dict[py::str(name)] = std::visit(*this, value);
    return dict;
  }
  template <typename T>
  py::list list_of(const std::vector<T>& values) const {
    py::list list;
    for (const T& value : values) list.append((*this)(value));
    return list;
  }
};

/// (name, words, unit, value) of each.
py::list list_of(const Figures& figures) {
  constexpr const char* kUnits[] = {"", "mm", "mm^2", "mm^3", "mm^4", "g", "g/cm^3", "g mm^2", "rad", "rpm"};
  py::list list;
  for (const Figure& figure : figures)
    list.append(py::make_tuple(figure.name, figure.words, kUnits[static_cast<std::size_t>(figure.unit)],
                               std::visit(ToPython{}, figure.value)));
  return list;
}

py::dict dict_of(const Verdict& verdict) {
  py::list criteria;
  for (const Criterion& c : verdict.criteria)
    criteria.append(py::make_tuple(c.name, c.description, c.value, c.limit,
                                   c.kind == Criterion::Kind::at_most ? "at most" : "at least", c.pass()));
  py::dict dict;
  dict["passed"] = verdict.pass();
  dict["goal"] = verdict.goal;
  dict["headline"] = str_of(verdict.headline);
  dict["wanted"] = list_of(verdict.wanted);
  dict["figures"] = list_of(verdict.figures);
  dict["criteria"] = criteria;
  dict["meaning"] = strs_of(verdict.meaning);
  dict["notes"] = strs_of(verdict.notes);
  dict["mass"] = mass_dict(verdict.body);
  return dict;
}

/// (role, mesh, density in g/cm3, percent of infill) of each part.
py::list parts_of(const Outcome& outcome) {
  constexpr const char* kRoles[] = {"body", "insert", "plug", "modifier"};
  const bool is_made = !outcome.made.parts.empty();
  py::list parts;
  for (const Part& part : (is_made ? outcome.made : outcome.judged).parts) {
    const Body body{is_made ? as_stored("x" + outcome.stored_as, part.mesh) : part.mesh};
    parts.append(py::make_tuple(kRoles[static_cast<int>(part.role)], body, part.density_g_cm3,
                                part.infill ? py::object(py::float_(part.infill->percent)) : py::object(py::none())));
  }
  return parts;
}

/// The rows of a command's options: (heading, name, value, words, details, kind, default, repeated, also, range, alone).
py::list settings_of(const std::string& word, const std::string& goal) {
  Defaults defaults = defaults_of(word, goal);
  struct Kind {
    std::string operator()(const double*) const { return "number"; }
    std::string operator()(const std::optional<double>*) const { return "number"; }
    std::string operator()(const int*) const { return "whole"; }
    std::string operator()(const bool*) const { return "switch"; }
    std::string operator()(const TextPlace&) const { return "text"; }
  };
  py::list rows;
  for (const tool::Group& group : defaults.groups())
    for (const Setting& s : group.settings) {
      const auto* text = std::get_if<TextPlace>(&s.place);
      const std::string usual = text && !text->show ? "" : shown(s);
      const bool bounded = std::isfinite(s.range.lo) || std::isfinite(s.range.hi);
      rows.append(py::make_tuple(group.heading, s.name.substr(0, s.name.find(',')), s.value, s.words, s.details,
                                 s.value.empty() ? "switch" : std::visit(Kind{}, s.place), usual, s.repeated, s.also,
                                 bounded ? s.range.words() : "", s.alone));
    }
  return rows;
}

py::object run_hollow(const Words& words, const Given& given, const py::object& callback) {
  Talk talk(callback);
  Outcome outcome = without_gil(talk, [&](const Progress& progress) { return hollow(words, given, progress); });
  outcome.report.timings_s = talk.timings();
  talk.done();
  return py::cast(std::move(outcome));
}

py::object run_verify(const Words& words, const Given& given, const py::object& callback) {
  Talk talk(callback);
  Outcome outcome = without_gil(talk, [&](const Progress& progress) { return verify(words, given, progress); });
  outcome.report.timings_s = talk.timings();
  talk.done();
  return py::cast(std::move(outcome));
}

py::list run_advise(const Words& words, const Given& given, const py::object& callback) {
  Talk talk(callback);
  const Advice advice = without_gil(talk, [&](const Progress& progress) { return advise(words, given, progress); });
  py::list suggestions;
  for (const Suggestion& one : advice.suggestions) suggestions.append(py::make_tuple(one.change, one.options));
  return suggestions;
}

py::dict dict_of(const Measurement& measurement) {
  py::list features;
  for (const PrintedFeature& feature : measurement.printed.features)
    features.append(py::make_tuple(str_of(feature.name), feature.of_body, feature.s[M1]));
  py::dict dict;
  dict["density"] = measurement.density_g_cm3;
  dict["slicer"] = str_of(measurement.printed.slicer);
  dict["features"] = features;
  dict["mass"] = mass_dict(measurement.body);
  dict["notes"] = strs_of(measurement.printed.notes);
  dict["json"] = to_json(measurement);
  dict["text"] = str_of(to_text(measurement));
  return dict;
}

py::dict dict_of(const Looked& looked) {
  const MeshReport& report = looked.input.check;
  py::dict defects;
  const std::pair<const char*, const Defect&> all[] = {{"not_finite", report.not_finite},
                                                       {"degenerate", report.degenerate},
                                                       {"duplicate", report.duplicate},
                                                       {"open_edges", report.open_edges},
                                                       {"non_manifold_edges", report.non_manifold_edges},
                                                       {"misoriented_edges", report.misoriented_edges},
                                                       {"unbalanced_edges", report.unbalanced_edges},
                                                       {"self_intersections", report.self_intersections}};
  for (const auto& [name, defect] : all)
    if (defect) defects[name] = py::make_tuple(defect.count, array_of(defect.first_mm));
  py::dict dict;
  dict["usable"] = report.usable;
  dict["refusal"] = str_of(report.refusal);
  dict["defects"] = defects;
  dict["area"] = looked.area_mm2;
  dict["mass"] = looked.mass ? py::object(mass_dict(*looked.mass)) : py::object(py::none());
  std::vector<std::string> notes = looked.input.notes;
  notes.insert(notes.end(), report.notes.begin(), report.notes.end());
  dict["notes"] = strs_of(notes);
  dict["json"] = to_json(looked.inspection());
  dict["text"] = str_of(to_text(looked.inspection()));
  return dict;
}

void bind_outcome(py::module_& module) {
  py::class_<Outcome> outcome(module, "Outcome");
  outcome.def_property_readonly("verdict", [](const Outcome& o) { return dict_of(o.report.after); });
  outcome.def_property_readonly("before", [](const Outcome& o) { return list_of(o.report.before); });
  outcome.def_property_readonly("proof", [](const Outcome& o) { return o.report.hollow->proof; });
  outcome.def_property_readonly("changed", [](const Outcome& o) { return str_of(o.report.changed); });
  outcome.def_property_readonly("gcode", [](const Outcome& o) { return str_of(o.gcode); });
  outcome.def_property_readonly("parts", &parts_of);
  outcome.def_property_readonly("spec", [](const Outcome& o) {
    py::dict spec;
    for (const Found& found : judged_by(o)) spec[py::str(found.name)] = found.value;
    return spec;
  });
  outcome.def_property_readonly(
      "outside", [](const Outcome& o) { return o.outside.triangles.empty() ? std::nullopt : std::optional(Body{o.outside}); });
  outcome.def("json", [](const Outcome& o) { return to_json(o.report); });
  outcome.def("text", [](const Outcome& o, bool verbose) { return str_of(to_text(o.report, verbose)); });
  outcome.def("html", [](const Outcome& o) { return py::bytes(to_html(o.report, o.judged)); });
  outcome.def("urdf", [](const Outcome& o) { return urdf_inertial(o.report.after.body); });
  outcome.def("mjcf", [](const Outcome& o) { return mjcf_inertial(o.report.after.body); });
  outcome.def(
      "export", [](const Outcome& o, const std::filesystem::path& path) { export_to(path, o); },
      py::call_guard<py::gil_scoped_release>());
  outcome.def("picture", [](const Outcome& o, const std::string& ending, const std::string& plane) {
    Talk talk{py::none()};
    return py::bytes(without_gil(talk, [&](const Progress& progress) { return picture(o, ending, plane, progress); }));
  });
}

}  // namespace

void bind_runs(py::module_& module) {
  py::class_<Given>(module, "Given").def(py::init(&given_of));
  bind_outcome(module);
  module.def("settings", &settings_of);
  module.def("load", [](const Words& words, const py::object& callback) {
    Talk talk(callback);
    return without_gil(talk, [&](const Progress& progress) { return load(words, progress); });
  });
  module.def("repair", [](const Body& body, bool guess) {
    Talk talk{py::none()};
    return without_gil(talk, [&](const Progress& progress) { return checked(body, {.repair = guess}, progress); });
  });
  module.def("hollow", &run_hollow);
  module.def("advise", &run_advise);
  module.def("verify", &run_verify);
  module.def("measure", [](const Words& words, const Given& given) {
    Talk talk{py::none()};
    return dict_of(without_gil(talk, [&](const Progress& progress) { return measure(words, given, progress); }));
  });
  module.def("inspect", [](const Words& words, const Given& given) {
    Talk talk{py::none()};
    return dict_of(without_gil(talk, [&](const Progress& progress) { return inspect(words, given, progress); }));
  });
  module.def("write_text",
             [](const std::filesystem::path& path, const py::bytes& text) { write_text_file(path, std::string(text)); });
  module.def("is_printed", [](const std::filesystem::path& path) { return is_printed(path); });
}

}  // namespace rayrep::python
