#include "session.h"

#include <openssl/evp.h>

#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <cmath>
#include <fstream>
#include <set>
#include <sstream>
#include <system_error>
#include <utility>

#include "measure.h"
#include "rayrep/report/page_data.h"

namespace rayrep::tool {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

std::string dumped(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

// ------------------------------------------------------------------------------------------------------------------------- files

std::string bytes_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream bytes;
  bytes << in.rdbuf();
  if (!in.is_open() || in.bad()) throw Error(ErrorCode::input, "Cannot read '" + file.string() + "'.");
  return bytes.str();
}

/// As a name here: without folders and control characters, neither hidden nor like an option, and not longer than file systems
/// take.
std::string plain_name(const std::string& given) {
  constexpr std::size_t kMost = 120;
  std::string name;
  for (const char c : given.substr(given.find_last_of("/\\") + 1))  // npos + 1: from the beginning
    if (static_cast<unsigned char>(c) >= 0x20 && c != 0x7F) name += c;
  if (name.size() > kMost) name = name.substr(name.size() - kMost);  // with its ending
  if (name.empty() || name[0] == '.' || name[0] == '-') name = "mesh" + name;
  return name;
}

// ----------------------------------------------------------------------------------------------------------------- what is packed

std::string base64(const std::string& bytes) {
  std::string text(4 * ((bytes.size() + 2) / 3), '\0');
  std::string buffer(text.size() + 1, '\0');
  EVP_EncodeBlock(reinterpret_cast<unsigned char*>(buffer.data()), reinterpret_cast<const unsigned char*>(bytes.data()),
                  static_cast<int>(bytes.size()));
  std::copy_n(buffer.begin(), text.size(), text.begin());
  return text;
}

/// Low byte first.
void put(std::uint32_t value, int bytes, std::string& out) {
  for (int n = 0; n < bytes; ++n) out += static_cast<char>(value >> (8 * n) & 0xFF);
}

/// The stretches of the rays with their frame, in that of the mesh.
Json columns_json(const Preview& preview) {
  const RayRep& rays = preview.voids;
  const RayGrid& grid = rays.grid;
  const Eigen::Matrix3d& axes = preview.to_working.linear();  // rows: the frame's axes
  const Eigen::Vector3d origin = preview.to_working.inverse() * Eigen::Vector3d(grid.origin_mm.x(), grid.origin_mm.y(), 0);
  std::string bytes;
  for (std::size_t ray = 0; ray < grid.size(); ++ray)
    for (std::uint32_t n = rays.first[ray]; n < rays.first[ray + 1]; ++n) {
      put(static_cast<std::uint32_t>(ray % static_cast<std::size_t>(grid.nx)), 2, bytes);
      put(static_cast<std::uint32_t>(ray / static_cast<std::size_t>(grid.nx)), 2, bytes);
      for (const double end : {rays.intervals[n].lo, rays.intervals[n].hi})
        put(std::bit_cast<std::uint32_t>(static_cast<float>(end)), 4, bytes);
    }
  Json json = {{"axes", Json::array()},
               {"origin_mm", {origin.x(), origin.y(), origin.z()}},
               {"spacing_mm", grid.spacing_mm},
               {"count", rays.intervals.size()},
               {"bytes", base64(bytes)}};
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) json["axes"].push_back(axes(row, column));
  return json;
}

Json blocks_json(const PageData& data) {
  Json blocks = Json::object();
  for (const auto& [id, packed] : data.meshes) blocks[id] = packed;
  return blocks;
}

/// What came in, in short.
Json summary_json(const Json& page, const MeshReport& check) {
  const Json& input = page.at("report").at("input");
  Json summary = {{"format", input.at("format")}, {"size_mm", input.at("size_mm")}, {"triangles", input.at("triangles")},
                  {"notes", input.at("notes")},   {"usable", check.usable},         {"rows", page.at("told").at("figures")}};
  if (check.usable) return summary;
  summary["refusal"] = check.refusal;
  summary["repairable"] = check.repairable;
  return summary;
}

/// What of the settings decides how the mesh is read.
std::string key_of(const Options& options) {
  Options copy = options;
  std::string key;
  for (const Group& group : groups_of(commands().front(), copy))
    for (const Setting& s : group.settings)
      if (s.name == "unit" || s.name == "size" || s.name == "repair") key += shown(s) + " ";
  return key;
}

double factor_of(const InputSummary& summary) { return summary.mm_per_unit * summary.scale; }

/// Of few rays: what the judge finds of the body that the solver has, in the hull that there is.
Verdict judged(const Preview& preview, const Progress& progress) {
  Spec spec = preview.spec;
  if (auto* stand = std::get_if<StandSpec>(&spec)) stand->flatten_mm = 0;  // it stands on the base that was cut
  Limits quick;
  quick.release_directions = 0;  // of one that floats: three quarters of the time; whether it comes back the plan has found
  return verify_print(preview.outside, preview.moments, spec, quick, progress);
}

}  // namespace

Session::Session(const Options& options, fs::path folder) : options_(options), folder_(std::move(folder)) {}

std::string Session::told(const std::string& message) const {
  const std::string here = folder_.string() + "/";
  std::string text = message;
  for (std::size_t at = text.find(here); at != std::string::npos; at = text.find(here, at)) {
    const std::size_t slash = text.find('/', at + here.size());
    text.erase(at, slash == std::string::npos ? here.size() : slash + 1 - at);
  }
  return text;
}

Session::Loaded Session::loaded() const {
  const std::lock_guard lock(telling_);
  if (!loaded_) throw Refused(409, "usage", "There is no mesh yet: drop one on the page.");
  return *loaded_;
}

void Session::load_scene(const fs::path& path, const Progress& progress) {
  scene_ = std::make_unique<SceneSession>(path, MotionCheckOptions{}, progress);
}

SceneSession& Session::scene() {
  if (!scene_) throw Refused(404, "none", "There is no scene here: begin with one, rayrep studio SCENE.json.");
  return *scene_;
}

std::string Session::start() const {
  if (scene_) return "{\"contract\":1,\"version\":" + dumped(version()) + ",\"scene\":" + scene_->start() + "}";
  const std::lock_guard lock(telling_);
  Json json = {{"contract", 1},
               {"version", version()},
               {"most_upload_bytes", options_.studio.most_upload_bytes},
               {"mesh", loaded_ ? Json::parse(loaded_->json) : Json(nullptr)},
               {"goals", goals_json()}};
  return dumped(json);
}

// -------------------------------------------------------------------------------------------------------------------------- mesh

Session::Reading Session::read_anew(const Options& options, const Progress& progress) {
  Reading reading;
  reading.key = key_of(options);
  reading.mesh = read(options.input, options, {}, progress);
  reading.mesh.summary.path = options.input.filename().string();
  if (!reading.mesh.checked.report.usable) return reading;
  reading.bodies = bodies_of(reading.mesh.checked.mesh, progress).count;
  reading.previewer = std::make_unique<Previewer>(reading.mesh.checked.mesh);
  return reading;
}

std::string Session::load(const std::string& name, const std::string& bytes) {
  const Latest::Turn turn(latest_, Latest::Kind::works);
  const fs::path folder = folder_ / ("mesh-" + std::to_string(++loads_));
  const Progress progress{.stage = {}, .cancelled = [this] { return ended_.load(); }};
  std::error_code ignored;
  try {
    fs::create_directory(folder);
    const fs::path path = folder / plain_name(name);
    std::ofstream(path, std::ios::binary) << bytes;
    if (fs::file_size(path, ignored) != bytes.size()) throw Error(ErrorCode::write, "There is no room for the mesh here.");
    Options options = options_of(Wanted{}, path.filename().string());
    options.input = path;
    Reading reading = read_anew(options, progress);
    const LookedAt found = look_at(options, reading.mesh, progress);
    const MeshFile shown{.mesh = reading.mesh.checked.mesh, .format = "", .notes = {}, .modifiers = {}};
    const PageData data = page_data(inspection_of(options, reading.mesh, found), delivery_of(shown, std::nullopt));
    const Json page = Json::parse(data.json);
    const std::string json = dumped({{"name", path.filename().string()},
                                     {"summary", summary_json(page, reading.mesh.checked.report)},
                                     {"view", page.at("view")},
                                     {"blocks", blocks_json(data)}});
    const std::optional<Document> before =
        std::exchange(document_, Document{.path = path, .factor = factor_of(reading.mesh.summary), .last = std::move(reading)});
    const std::lock_guard lock(telling_);
    loaded_ = {path, json};
    if (before) fs::remove_all(before->path.parent_path(), ignored);
    return json;
  } catch (...) {
    fs::remove_all(folder, ignored);
    throw;
  }
}

std::string Session::mesh_bytes() const {
  const std::lock_guard lock(telling_);  // its file stays as long
  if (!loaded_) throw Refused(404, "none", "There is no mesh yet.");
  return bytes_of(loaded_->path);
}

// ----------------------------------------------------------------------------------------------------------------------- preview

Session::Reading& Session::reading_for(const Options& options, const Progress& progress) {
  Reading& last = document_->last;
  if (last.key != key_of(options)) last = read_anew(options, progress);
  return last;
}

std::string Session::looked(const Wanted& wanted, Options options, const Progress& progress) {
  constexpr int kRays = 60;  // along the longest side
  const auto begun = std::chrono::steady_clock::now();
  options.input = document_->path;
  Reading& reading = reading_for(options, progress);
  refuse_unusable(reading.mesh);
  if (reading.bodies > 1 && !options.rigid) refuse_loose_bodies(options, reading.mesh, progress);
  HollowOptions how = hollow_options(options, progress);
  how.resolution = kRays;
  const Preview preview = reading.previewer->look(options.spec, how, progress);
  const Verdict verdict = judged(preview, progress);
  Json json = Json::parse(page_json(verdict, preview.outside));
  Options found = options;
  found.spec = preview.spec;
  json["sequence"] = wanted.sequence;
  json["spec"] = values_json(found);
  json["attitude"] = json["attitudes"].at(0);
  json["columns"] = columns_json(preview);
  json["scale"] = factor_of(reading.mesh.summary) / document_->factor;
  json["seconds"] = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  return dumped(json);
}

std::string Session::preview(const std::string& wanted_json) {
  const Wanted wanted = wanted_from(wanted_json);
  const Latest::Turn turn(latest_, Latest::Kind::looks);
  const auto superseded = [] { return Refused(409, "superseded", "There is a newer one."); };
  if (turn.superseded()) throw superseded();
  if (!document_) loaded();  // says so
  try {
    const Options options = options_of(wanted, document_->path.filename().string());
    return looked(wanted, options, {.stage = {}, .cancelled = [&turn] { return turn.superseded(); }});
  } catch (const Error& error) {
    if (error.code() == ErrorCode::interrupted) throw superseded();
    throw;
  }
}

// --------------------------------------------------------------------------------------------------------------------------- run

std::vector<std::string> Session::words_to_write(const Run& run, const std::string& output) const {
  std::vector<std::string> words = words_of(run.wanted, run.mesh);
  for (const std::string& word : {"--output=" + output, std::string("--no-advice"), std::string("--verbose")})
    words.push_back(word);
  if (options_.threads > 0) words.push_back("--threads=" + std::to_string(options_.threads));
  return words;
}

/// A new one for the next run, which has the number runs_ then.
fs::path Session::cleared_folder() {
  if (run_ && run_->child->status().state == ChildRun::State::running)
    throw Refused(409, "running", "A run is going on: wait for its end, or cancel it.");
  std::error_code ignored;
  const fs::path before = run_ ? run_->folder.parent_path() : fs::path();
  run_.reset();
  if (!before.empty()) fs::remove_all(before, ignored);
  fs::path folder = folder_ / ("run-" + std::to_string(++runs_)) / "files";
  fs::create_directories(folder);
  return folder;
}

std::string Session::begin_run(const std::string& wanted_json) {
  if (scene_) return begin_balance(wanted_json);
  Wanted wanted = wanted_from(wanted_json);
  const Loaded mesh = loaded();
  const std::string name = mesh.path.filename().string();
  const Options options = options_of(wanted, name);
  const std::lock_guard lock(running_);
  const std::string stem = fs::path(name).stem().string() + "_" + wanted.goal;
  Run run;
  run.folder = cleared_folder();
  run.number = runs_;
  run.wanted = std::move(wanted);
  run.mesh = name;
  run.output = stem + ".3mf";
  {
    const std::lock_guard telling(telling_);
    if (loaded_->path != mesh.path) throw Refused(409, "superseded", "Another mesh has been loaded meanwhile.");
    fs::copy_file(mesh.path, run.folder / name);
  }
  std::ofstream(run.folder / (stem + ".config.json")) << config_of(run.wanted, name).dump(2) << "\n";
  std::vector<std::string> words = words_to_write(run, run.output);
  words.push_back("--html=" + stem + ".html");
  words.push_back("--report=" + stem + ".json");
  run.child = std::make_unique<ChildRun>(run.folder, words, options);
  run_ = std::move(run);
  return dumped({{"run", run_->number}});
}

namespace {
constexpr const char* kBalanced = "balanced";  ///< where rayrep balance writes
}

std::string Session::begin_balance(const std::string& edit) {
  scene_->file(edit);  // says what is wrong with it
  const std::lock_guard lock(running_);
  Run run;
  run.folder = cleared_folder();
  run.number = runs_;
  run.mesh = plain_name(scene_->name());
  run.output = fs::path(run.mesh).stem().string() + ".html";
  std::ofstream(run.folder / run.mesh) << scene_->file(edit, run.folder / run.mesh);
  std::vector<std::string> words = {"balance", run.mesh, std::string("--output=") + kBalanced, "--html=" + run.output, "--verbose"};
  if (options_.threads > 0) words.push_back("--threads=" + std::to_string(options_.threads));
  const std::array<const char*, 3> arguments = {"rayrep", "balance", run.mesh.c_str()};
  const Options options = parse_command_line(static_cast<int>(arguments.size()), arguments.data());
  run.child = std::make_unique<ChildRun>(run.folder, words, options);
  run_ = std::move(run);
  return dumped({{"run", run_->number}});
}

std::string Session::run_status() {
  static constexpr const char* kStates[] = {"running", "done", "failed", "cancelled"};
  const std::lock_guard lock(running_);
  if (!run_) return dumped({{"run", 0}, {"state", "none"}, {"stage", ""}, {"share", nullptr}, {"left_s", nullptr}});
  const ChildRun::Status status = run_->child->status();
  Json json = {{"run", run_->number},
               {"state", kStates[static_cast<std::size_t>(status.state)]},
               {"stage", status.stage},
               {"share", status.share ? Json(*status.share) : Json(nullptr)},
               {"left_s", status.left_s ? Json(*status.left_s) : Json(nullptr)}};
  if (status.state == ChildRun::State::failed) json["error"] = {{"kind", status.kind}, {"message", status.message}};
  return dumped(json);
}

void Session::cancel_run() {
  const std::lock_guard lock(running_);
  if (!run_) return;
  run_->child->cancel();
  run_->child->wait();
}

Session::Run& Session::finished_run() {
  if (!run_ || run_->child->status().state != ChildRun::State::done)
    throw Refused(409, "none", "There is no result: nothing was run, or it has not ended well.");
  return *run_;
}

namespace {

/// Nothing sparse can be told in it.
std::string other_format(const std::string& output) { return fs::path(output).replace_extension(".stl").string(); }

/// What a file of a run holds, by its name.
std::string words_of_file(const std::string& name, const std::string& output) {
  const std::string stem = fs::path(output).stem().string();
  if (name == output) return "the body, as it was judged";
  if (name == other_format(output)) return "the same as STL, made and judged when you ask for it";
  if (name == stem + ".html") return "the page with everything that was found";
  if (name == stem + ".json") return "the same for programs";
  if (name == stem + ".config.json") return "the settings, for --config";
  if (name.starts_with(stem + "_core") || name.starts_with(stem + "_balls")) return "what is put in";
  if (name.starts_with(stem + "_outside")) return "the outside alone, as it was changed";
  return "what is dense or sparse alone";
}

}  // namespace

std::vector<std::string> Session::files_of(const Run& run) {
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(run.folder))
    if (entry.is_regular_file()) names.insert(entry.path().filename().string());
  const Options options = options_of(run.wanted, run.mesh);
  if (!print_of(options.spec).infill.wanted() && !makes_pieces(options)) names.insert(other_format(run.output));
  names.erase(run.mesh);
  names.erase(run.output);
  std::vector<std::string> files = {run.output};
  files.insert(files.end(), names.begin(), names.end());
  return files;
}

/// The scene first, then its parts, then the page.
std::vector<std::string> Session::balanced_files(const Run& run) {
  std::set<std::string> parts;
  for (const auto& entry : fs::directory_iterator(run.folder / kBalanced))
    if (entry.is_regular_file()) parts.insert(entry.path().filename().string());
  parts.erase(run.mesh);
  std::vector<std::string> files = {run.mesh};
  files.insert(files.end(), parts.begin(), parts.end());
  files.push_back(run.output);
  return files;
}

Session::Download Session::balanced_download(const std::string& name) {
  const std::lock_guard lock(running_);
  const Run& run = finished_run();
  const std::vector<std::string> files = balanced_files(run);
  if (std::find(files.begin(), files.end(), name) == files.end()) throw Refused(404, "none", "There is no file of that name.");
  if (name == run.output) return {name, bytes_of(run.folder / name)};
  const fs::path file = run.folder / kBalanced / name;
  return {name, name == run.mesh ? scene_->file_with_parts(file) : bytes_of(file)};
}

std::string Session::result() {
  const std::lock_guard lock(running_);
  const Run& run = finished_run();
  if (scene_) {
    Json files = Json::array();
    for (const std::string& name : balanced_files(run))
      files.push_back({{"name", name},
                       {"words", name == run.mesh     ? "the scene that names them: put all into one folder beside the first one"
                                 : name == run.output ? "the page with how it rests"
                                                      : "a part, as it was judged"}});
    return dumped({{"files", files}});
  }
  const std::string stem = fs::path(run.output).stem().string();
  const PageData data = page_data(bytes_of(run.folder / (stem + ".html")));
  Json files = Json::array();
  for (const std::string& name : files_of(run)) files.push_back({{"name", name}, {"words", words_of_file(name, run.output)}});
  // The data is text already: it is large, and need not be taken apart.
  return "{\"data\":" + data.json + ",\"blocks\":" + dumped(blocks_json(data)) +
         ",\"command\":" + dumped(command_line(run.wanted, run.mesh)) + ",\"config\":" + dumped(config_of(run.wanted, run.mesh)) +
         ",\"files\":" + dumped(files) + "}";
}

fs::path Session::in_other_format() {
  int number = 0;
  std::string name;
  {
    const std::lock_guard lock(running_);
    Run& run = finished_run();
    number = run.number;
    name = other_format(run.output);
    if (!run.other) {
      const fs::path folder = run.folder.parent_path() / "other";
      fs::create_directory(folder);
      fs::copy_file(run.folder / run.mesh, folder / run.mesh, fs::copy_options::overwrite_existing);
      run.other = std::make_unique<ChildRun>(folder, words_to_write(run, name), options_of(run.wanted, run.mesh));
    }
  }
  for (;; std::this_thread::sleep_for(std::chrono::milliseconds(20))) {
    const std::lock_guard lock(running_);
    if (!run_ || run_->number != number) throw Refused(409, "superseded", "Another run has begun since.");
    const ChildRun::Status status = run_->other->status();
    if (status.state == ChildRun::State::done) return run_->folder.parent_path() / "other" / name;
    if (status.state == ChildRun::State::running) continue;
    run_->other.reset();
    throw Refused(422, status.kind, status.message);
  }
}

Session::Download Session::download(const std::string& name) {
  if (scene_) return balanced_download(name);
  std::string output;
  fs::path file;
  {
    const std::lock_guard lock(running_);
    const Run& run = finished_run();
    const std::vector<std::string> files = files_of(run);
    if (std::find(files.begin(), files.end(), name) == files.end()) throw Refused(404, "none", "There is no file of that name.");
    output = run.output;
    file = run.folder / name;
  }
  if (name == other_format(output)) file = in_other_format();
  return {name, bytes_of(file)};
}

void Session::end() {
  ended_ = true;
  if (scene_) scene_->end();
  latest_.end();
  const std::lock_guard lock(running_);
  run_.reset();
}

}  // namespace rayrep::tool
