#include "batch.h"

#include <fcntl.h>
#include <openssl/evp.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <csignal>
#include <fstream>
#include <iostream>
#include <list>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <system_error>
#include <thread>

#include "jobs.h"
#include "rayrep/base/child_process.h"
#include "rayrep/rayrep.h"

namespace rayrep::tool {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using Clock = std::chrono::steady_clock;

// ---------------------------------------------------------------------------------------------------------------------- hashes

using Digest = std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)>;

std::string hex(Digest& digest) {
  std::array<unsigned char, EVP_MAX_MD_SIZE> bytes{};
  unsigned int count = 0;
  EVP_DigestFinal_ex(digest.get(), bytes.data(), &count);
  constexpr const char* digits = "0123456789abcdef";
  std::string text;
  for (unsigned int n = 0; n < count; ++n) text += {digits[bytes[n] / 16], digits[bytes[n] % 16]};
  return text;
}

Digest sha256() {
  Digest digest(EVP_MD_CTX_new(), &EVP_MD_CTX_free);
  EVP_DigestInit_ex(digest.get(), EVP_sha256(), nullptr);
  return digest;
}

std::string sha256_of(const std::string& text) {
  Digest digest = sha256();
  EVP_DigestUpdate(digest.get(), text.data(), text.size());
  return hex(digest);
}

/// Of a file, as sha256sum tells it; empty where it cannot be read.
std::string sha256_of_file(const fs::path& path) {
  std::error_code ignored;
  std::ifstream in(path, std::ios::binary);
  if (!in || !fs::is_regular_file(path, ignored)) return {};
  Digest digest = sha256();
  std::vector<char> block(1 << 20);
  while (in.read(block.data(), static_cast<std::streamsize>(block.size())), in.gcount() > 0)
    EVP_DigestUpdate(digest.get(), block.data(), static_cast<std::size_t>(in.gcount()));
  return hex(digest);
}

// ---------------------------------------------------------------------------------------------------------------------- folders

std::string this_host() {
  std::array<char, 256> name{};
  ::gethostname(name.data(), name.size() - 1);
  return name.data();
}

/// Where a job of this process works: ".work-HOST-PROCESS-ID".
fs::path work_folder(const fs::path& folder, const std::string& id) {
  return folder / (".work-" + this_host() + "-" + std::to_string(::getpid()) + "-" + id);
}

/// Removes what killed batches of this host have left.
void remove_abandoned_work(const fs::path& folder) {
  const std::string begin = ".work-" + this_host() + "-";
  std::vector<fs::path> abandoned;
  std::error_code ignored;
  for (fs::directory_iterator entry(folder, ignored), end; !ignored && entry != end; entry.increment(ignored)) {
    const std::string name = entry->path().filename().string();
    if (!name.starts_with(begin)) continue;
    const long process = std::strtol(name.c_str() + begin.size(), nullptr, 10);
    if (process > 0 && ::kill(static_cast<pid_t>(process), 0) != 0 && errno == ESRCH) abandoned.push_back(entry->path());
  }
  for (const fs::path& path : abandoned) fs::remove_all(path, ignored);
}

void make_folder(const fs::path& path) {
  std::error_code error;
  fs::create_directories(path, error);
  if (error) throw Error(ErrorCode::write, "Cannot make the folder '" + path.string() + "': " + error.message() + ".");
}

/// Writes text in a work folder and gets it into place by renaming: whoever is killed leaves nothing elsewhere.
void put_in_place(const fs::path& work, const fs::path& target, const std::string& text) {
  write_text_file(work / "text", text);
  std::error_code error;
  fs::rename(work / "text", target, error);
  if (error) throw Error(ErrorCode::write, "Cannot put '" + target.string() + "' in place: " + error.message() + ".");
}

/// While there is one no other process has one on the same file.
class Lock {
public:
  explicit Lock(const fs::path& path) : descriptor_(::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666)) {
    if (descriptor_ >= 0) ::flock(descriptor_, LOCK_EX);
  }
  ~Lock() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }
  Lock(const Lock&) = delete;
  Lock& operator=(const Lock&) = delete;

private:
  int descriptor_;
};

// ------------------------------------------------------------------------------------------------------------------------- jobs

/// A job with what it takes to run it.
struct Planned {
  Job job;
  Options options;    ///< as its command line says
  std::string input;  ///< SHA-256 of its mesh
  std::string key;    ///< of job, files that it reads, version and ending: what is run once need not be again
};

/// Hashes of files that have been read.
using Hashes = std::map<std::string, std::string>;

std::string hash_of(const std::string& path, Hashes& hashes) {
  const auto [known, is_new] = hashes.try_emplace(path);
  if (is_new) known->second = sha256_of_file(path);
  return known->second;
}

/// @throws Error{usage} with the job
Planned plan_job(const Job& job, Hashes& hashes) {
  const auto refuse = [&job](const std::string& why) { throw Error(ErrorCode::usage, "Job " + job.id + ": " + why); };
  static const std::set<std::string> ours = {"output", "report", "html", "quiet", "verbose", "json",      "threads",
                                             "help",   "gcode",  "urdf", "mjcf",  "suggest", "no-advice", "save-config"};
  for (const auto& [name, value] : job.options)
    if (ours.contains(name)) refuse("--" + name + " is for batch to say: leave it out.");
  std::vector<std::string> words = job.words();
  std::vector<const char*> arguments{"rayrep"};
  for (const std::string& word : words) arguments.push_back(word.c_str());
  Planned planned{job, {}, hash_of(job.mesh, hashes), {}};
  try {
    planned.options = parse_command_line(static_cast<int>(arguments.size()), arguments.data());
  } catch (const Error& error) {
    refuse(error.what());
  }
  const Command command = planned.options.command;
  if (command == Command::batch || command == Command::sweep || command == Command::studio || command == Command::text ||
      planned.options.takes_scene())
    refuse("'" + job.command + "' is no command for a job.");
  planned.key = version() + '\n' + planned.input + '\n' + to_line(job);
  // Files that options name: FILE, or FILE=G_CM3.
  for (const auto& [name, value] : job.options)
    for (const std::string& file : {value, value.substr(0, value.rfind('='))}) planned.key += '\n' + hash_of(file, hashes);
  planned.key = sha256_of(planned.key);
  return planned;
}

/// The line of a job that has been run as it would be now; none: it has not.
std::optional<Json> known_line(const fs::path& folder, const Planned& planned) {
  std::ifstream in(folder / "lines" / (planned.job.id + ".json"), std::ios::binary);
  if (!in) return std::nullopt;
  Json line = Json::parse(in, nullptr, false);
  if (line.is_discarded() || !line.is_object() || line.value("key", "") != planned.key) return std::nullopt;
  return line;
}

/// Whether a job ended by what need not happen again.
bool is_worth_another_try(const Json& line) { return line.contains("ended"); }

/// A job that runs.
class Running {
public:
  Running(const Planned& planned, const BatchOptions& batch, const fs::path& program)
      : planned_(planned), batch_(batch), work_(work_folder(batch.folder, planned.job.id)), started_(Clock::now()) {
    make_folder(work_);
    child_ = std::make_unique<ChildProcess>(ProgramCall{program.string(), words(), {}, work_ / "output", work_ / "errors"});
  }
  ~Running() {
    child_.reset();
    std::error_code ignored;
    if (!work_.empty()) fs::remove_all(work_, ignored);
  }
  Running(const Running&) = delete;
  Running& operator=(const Running&) = delete;

  ChildProcess* child() const { return child_.get(); }
  bool has_ended() {
    if (batch_.time_limit_s && elapsed_s() > *batch_.time_limit_s) child_->stop();
    return child_->has_ended();
  }

  /// By hand, or with the batch: no result, the next batch runs it.
  bool was_interrupted() const {
    const Ended& ended = child_->ended();
    return ended.how == Ended::How::exited && ended.code > 128;
  }

  /// Puts in place what it has written, and last its line.
  Json deliver() const {
    const Ended& ended = child_->ended();
    Json line{{"id", planned_.job.id}};
    line.update(Json::parse(to_line(planned_.job)));
    line["exit"] = ended.how == Ended::How::exited             ? ended.code
                   : ended.how == Ended::How::killed_by_signal ? 128 + ended.code
                                                               : 124;
    if (ended.how == Ended::How::killed_by_signal) line["ended"] = "by signal " + std::to_string(ended.code);
    if (ended.how == Ended::How::took_too_long) line["ended"] = "by --timeout";
    if (ended.how == Ended::How::not_found) throw Error(ErrorCode::internal, "rayrep cannot be run: " + ended.said + ".");
    line["message"] = in_place(Json(message(ended.said)));
    add_report(line);
    line["outputs"] = move_outputs();
    line["input_sha256"] = planned_.input;
    line["version"] = version();
    line["seconds"] = rounded(elapsed_s());
    line["cpu_seconds"] = rounded(ended.cpu_s);
    line["memory_mb"] = rounded(ended.peak_memory_mb);
    line["key"] = planned_.key;
    put_in_place(work_, batch_.folder / "lines" / (planned_.job.id + ".json"), line.dump() + "\n");
    return line;
  }

private:
  double elapsed_s() const { return std::chrono::duration<double>(Clock::now() - started_).count(); }
  static double rounded(double value) { return std::round(1000 * value) / 1000; }

  std::vector<std::string> words() const {
    std::vector<std::string> all = planned_.job.words();
    const Options& options = planned_.options;
    if (options.command == Command::hollow) {
      const std::string ending = batch_.ending.empty() ? options.output.extension().string() : batch_.ending;
      all.push_back("--output=" + (work_ / (planned_.job.id + ending)).string());
      all.emplace_back("--no-advice");
    }
    if (writes_report())
      all.push_back("--report=" + (work_ / "report").string());
    else
      all.emplace_back("--json");
    if (writes_report()) all.emplace_back("--quiet");
    all.push_back("--threads=" + std::to_string(batch_.threads_each));
    return all;
  }
  bool writes_report() const { return planned_.options.command == Command::hollow || planned_.options.command == Command::verify; }

  static std::string message(std::string said) {
    for (std::size_t at = 0; (at = said.find("rayrep: ", at)) != said.npos;) said.erase(at, 8);
    return said;
  }

  /// With the folder where it worked called by the name of the folder where things are in the end.
  Json in_place(Json json) const {
    if (json.is_string()) {
      std::string text = json.get<std::string>();
      const std::string here = work_.string();
      for (std::size_t at = 0; (at = text.find(here, at)) != text.npos;) text.replace(at, here.size(), batch_.folder.string());
      return text;
    }
    for (auto& part : json)
      if (part.is_structured() || part.is_string()) part = in_place(part);
    return json;
  }

  /// Its report beside the line, without what is another one every time; and of it what tells how it ended.
  void add_report(Json& line) const {
    std::ifstream in(work_ / (writes_report() ? "report" : "output"), std::ios::binary);
    Json report = in ? Json::parse(in, nullptr, false) : Json();
    const fs::path kept = batch_.folder / (planned_.job.id + ".json");
    std::error_code ignored;
    if (!report.is_object()) {
      fs::remove(kept, ignored);
      return;
    }
    report.erase("timings_s");
    report.erase("peak_memory_mb");
    if (report.contains("solver") && report["solver"].is_object()) report["solver"].erase("seconds");
    if (report.contains("options") && report["options"].is_object()) report["options"].erase("threads");
    report = in_place(std::move(report));
    for (const char* name : {"pass", "changed"})
      if (report.contains(name)) line[name] = report[name];
    line["figures"] = Json::object();
    for (const auto& [name, value] : (report.contains("after") ? report["after"] : report).items())
      if (value.is_number() || value.is_string() || value.is_boolean()) line["figures"][name] = value;
    put_in_place(work_, kept, report.dump(1) + "\n");
  }

  Json move_outputs() const {
    static const std::set<std::string> ours = {"output", "errors", "report"};
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(work_))
      if (const std::string name = entry.path().filename().string(); !ours.contains(name) && name[0] != '.') names.push_back(name);
    std::sort(names.begin(), names.end());
    for (const std::string& name : names) {
      std::error_code error;
      fs::rename(work_ / name, batch_.folder / name, error);
      if (error)
        throw Error(ErrorCode::write, "Cannot put '" + (batch_.folder / name).string() + "' in place: " + error.message() + ".");
    }
    return names;
  }

  const Planned& planned_;
  const BatchOptions& batch_;
  fs::path work_;
  Clock::time_point started_;
  std::unique_ptr<ChildProcess> child_;
};

// -------------------------------------------------------------------------------------------------------------------- the table

std::string csv_field(const Json& value) {
  const std::string text = value.is_null() ? "" : value.is_string() ? value.get<std::string>() : value.dump();
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string quoted_text = "\"";
  for (const char c : text) quoted_text += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted_text + "\"";
}

/// A row for each line: what was varied, how it ended, and its figures.
std::string csv(const std::vector<Json>& lines) {
  const std::vector<std::string> plain = {"id",      "command", "mesh",        "exit",      "ended",        "pass",   "changed",
                                          "message", "seconds", "cpu_seconds", "memory_mb", "input_sha256", "version"};
  std::vector<std::string> options;
  std::vector<std::string> figures;
  const auto add_names = [](const Json& line, const char* member, std::vector<std::string>& names) {
    if (!line.contains(member)) return;
    for (const auto& [name, value] : line[member].items())
      if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  };
  for (const Json& line : lines) {
    add_names(line, "options", options);
    add_names(line, "figures", figures);
  }
  std::string text;
  const auto row = [&text](const std::vector<std::string>& fields) {
    for (std::size_t n = 0; n < fields.size(); ++n) text += (n > 0 ? "," : "") + fields[n];
    text += "\n";
  };
  const auto each = [&](const auto& field) {
    std::vector<std::string> fields;
    for (const std::string& name : plain) fields.push_back(field("", name));
    for (const std::string& name : options) fields.push_back(field("options", name));
    for (const std::string& name : figures) fields.push_back(field("figures", name));
    row(fields);
  };
  each(
      [](const std::string& member, const std::string& name) { return csv_field(Json(member == "options" ? "--" + name : name)); });
  for (const Json& line : lines)
    each([&line](const std::string& member, const std::string& name) {
      const Json& from = member.empty() || !line.contains(member) ? line : line[member];
      return csv_field(from.contains(name) && (member.empty() || line.contains(member)) ? from[name] : Json());
    });
  return text;
}

/// All lines there are, of whatever batch, in the order of the jobs.
std::vector<Json> write_results(const std::vector<Planned>& jobs, const BatchOptions& batch) {
  const Lock one_at_a_time(batch.folder / "lines" / ".lock");
  std::vector<Json> lines;
  std::string text;
  for (const Planned& planned : jobs) {
    std::optional<Json> line = known_line(batch.folder, planned);
    if (!line) continue;
    line->erase("key");
    text += line->dump() + "\n";
    lines.push_back(std::move(*line));
  }
  const fs::path work = work_folder(batch.folder, "results");
  make_folder(work);
  put_in_place(work, batch.folder / "results.jsonl", text);
  std::error_code ignored;
  fs::remove_all(work, ignored);
  if (!batch.summary.empty()) write_text_file(batch.summary, csv(lines));
  return lines;
}

/// What of the jobs is for this shard and not done: each n-th, so that long ones at the end are shared out.
std::vector<const Planned*> to_do(const std::vector<Planned>& jobs, const BatchOptions& batch) {
  std::vector<const Planned*> todo;
  for (std::size_t n = 0; n < jobs.size(); ++n) {
    if (n % batch.shards != batch.shard - 1) continue;
    const std::optional<Json> line = known_line(batch.folder, jobs[n]);
    if (!line || (batch.retry && is_worth_another_try(*line))) todo.push_back(&jobs[n]);
  }
  return todo;
}

class Teller {
public:
  Teller(const Options& options, std::size_t count) : options_(options), count_(count), started_(Clock::now()) {}

  void tell(const Json& line) {
    ++done_;
    if (options_.quiet) return;
    const int code = line["exit"].get<int>();
    std::string text = std::to_string(done_) + "/" + std::to_string(count_) + "  " + line["id"].get<std::string>() + ": ";
    text += line.contains("ended") ? "ended " + line["ended"].get<std::string>()
            : code == 0            ? "done"
                                   : "exit " + std::to_string(code);
    if (options_.verbose && !line["message"].get<std::string>().empty()) text += ". " + line["message"].get<std::string>();
    if (done_ < count_) text += left();
    std::cerr << printable(text) << std::endl;
  }

  void skip() { ++done_; }

private:
  std::string left() const {
    const double spent_s = std::chrono::duration<double>(Clock::now() - started_).count();
    const double left_s = spent_s * static_cast<double>(count_ - done_) / static_cast<double>(done_);
    return left_s < 1 ? "" : ", about " + std::to_string(std::lround(left_s)) + " s to go";
  }

  const Options& options_;
  std::size_t count_;
  std::size_t done_ = 0;
  Clock::time_point started_;
};

void run_all(const std::vector<const Planned*>& todo, const Options& options, const Progress& progress) {
  const fs::path program = fs::read_symlink("/proc/self/exe");
  Teller teller(options, todo.size());
  std::list<Running> running;
  std::size_t next = 0;
  while (next < todo.size() || !running.empty()) {
    progress.check();
    while (next < todo.size() && running.size() < static_cast<std::size_t>(options.batch.at_once))
      running.emplace_back(*todo[next++], options.batch, program);
    std::vector<ChildProcess*> children;
    for (const Running& one : running) children.push_back(one.child());
    ChildProcess::wait_for_any(children, 0.2);
    for (auto one = running.begin(); one != running.end();) {
      if (!one->has_ended()) {
        ++one;
        continue;
      }
      if (one->was_interrupted())
        teller.skip();
      else
        teller.tell(one->deliver());
      one = running.erase(one);
    }
  }
}

}  // namespace

void run_batch(const Options& options, const Progress& progress) {
  Options resolved = options;
  BatchOptions& batch = resolved.batch;
  const int cores = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  if (batch.at_once == 0) batch.at_once = cores;
  batch.threads_each = std::max(1, cores / batch.at_once);
  std::vector<Planned> jobs;
  Hashes hashes;
  for (const Job& job : read_jobs(options.input)) {
    jobs.push_back(plan_job(job, hashes));
    if (jobs.back().options.command == Command::hollow) jobs.back().key = sha256_of(jobs.back().key + batch.ending);
  }
  make_folder(batch.folder / "lines");
  remove_abandoned_work(batch.folder);
  const std::vector<const Planned*> todo = to_do(jobs, batch);
  run_all(todo, resolved, progress);
  const std::vector<Json> lines = write_results(jobs, batch);
  if (options.quiet) return;
  std::size_t good = 0;
  std::size_t ended = 0;
  for (const Json& line : lines) {
    good += line["exit"] == 0;
    ended += line.contains("ended");
  }
  std::cout << lines.size() << " of " << jobs.size() << " jobs have their line, " << todo.size() << " of them run now: " << good
            << " done, " << lines.size() - good - ended << " refused or failed, " << ended << " crashed or took too long.\n"
            << "Wrote " << printable((batch.folder / "results.jsonl").string())
            << (batch.summary.empty() ? "" : " and " + printable(batch.summary.string())) << ".\n";
}

void run_sweep(const Options& options) {
  std::string text;
  Hashes hashes;
  for (const Job& job : options.sweep) {
    plan_job(job, hashes);
    text += to_line(job) + "\n";
  }
  if (options.output.empty())
    std::cout << text;
  else
    write_text_file(options.output, text);
}

}  // namespace rayrep::tool
