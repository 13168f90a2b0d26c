#include "child_run.h"

#include <algorithm>
#include <cctype>
#include <exception>
#include <fstream>
#include <utility>

#include "rayrep/base/child_process.h"
#include "rayrep/base/error.h"
#include "stages.h"

namespace rayrep::tool {
namespace {

constexpr const char* kSays = "rayrep: ";

/// What a command says with --verbose where it is followed by nobody: "rayrep: solve" when a stage begins, and why it failed.
struct Said {
  std::vector<std::string> stages;
  std::string message;
};

Said said_in(const std::filesystem::path& file) {
  Said said;
  std::ifstream in(file, std::ios::binary);
  for (std::string line; std::getline(in, line);) {
    const bool begins = line.starts_with(kSays);
    const std::string text = begins ? line.substr(std::string(kSays).size()) : line;
    const bool one_word = !text.empty() && std::all_of(text.begin(), text.end(), [](unsigned char c) { return std::islower(c); });
    if (begins && one_word) {
      said.stages.push_back(text);
      said.message.clear();
    } else {
      said.message += (said.message.empty() ? "" : "\n") + text;
    }
  }
  return said;
}

ChildRun::Status ended(const Ended& how, const std::string& message) {
  ChildRun::Status status;
  if (how.how == Ended::How::exited && how.code == 0) {
    status.state = ChildRun::State::done;
    status.share = 1;
    return status;
  }
  status.state = ChildRun::State::failed;
  status.kind = how.how == Ended::How::exited ? kind_of(how.code) : "internal";
  status.message = message;
  if (how.how == Ended::How::killed_by_signal)
    status.message = "The run was ended by signal " + std::to_string(how.code) +
                     (how.code == 9 ? ": probably there was not enough memory. Try a lower --resolution." : ".");
  if (how.how == Ended::How::not_found) status.message = "rayrep cannot start itself: " + how.said + ".";
  return status;
}

}  // namespace

std::string kind_of(int exit_code) {
  switch (static_cast<ErrorCode>(exit_code)) {
    case ErrorCode::usage:
      return "usage";
    case ErrorCode::input:
      return "input";
    case ErrorCode::goal:
      return "goal";
    case ErrorCode::solver:
      return "solver";
    case ErrorCode::write:
      return "write";
    default:
      return "internal";
  }
}

ChildRun::ChildRun(std::filesystem::path folder, std::vector<std::string> words, const Options& options)
    : folder_(std::move(folder)), thread_([this, words = std::move(words), options] { follow(words, options); }) {}

ChildRun::~ChildRun() {
  cancel();
  wait();
}

void ChildRun::wait() {
  if (thread_.joinable()) thread_.join();
}

ChildRun::Status ChildRun::status() const {
  const std::lock_guard lock(mutex_);
  return status_;
}

void ChildRun::set(const Status& status) {
  const std::lock_guard lock(mutex_);
  status_ = status;
}

void ChildRun::follow(const std::vector<std::string>& words, const Options& options) try {
  constexpr double kPoll_s = 0.05;
  // Beside the folder: in it may be a mesh of any name.
  const std::filesystem::path errors = folder_.string() + ".errors";
  ChildProcess child({.program = std::filesystem::read_symlink("/proc/self/exe").string(),
                      .arguments = words,
                      .folder = folder_,
                      .output = folder_.string() + ".output",
                      .errors = errors});
  Options quiet = options;
  quiet.quiet = true;
  Stages stages(quiet);
  std::size_t begun = 0;
  while (!child.has_ended()) {
    if (cancelled_) {
      child.stop();
      set({.state = State::cancelled});
      return;
    }
    const Said said = said_in(errors);
    for (; begun < said.stages.size(); ++begun) stages.begin(said.stages[begun]);
    Status status;
    status.stage = begun == 0 ? "" : said.stages[begun - 1];
    status.left_s = stages.seconds_left();
    if (status.left_s) status.share = stages.seconds_so_far() / (stages.seconds_so_far() + *status.left_s);
    set(status);
    ChildProcess::wait_for_any({&child}, kPoll_s);
  }
  set(ended(child.ended(), said_in(errors).message));
} catch (const std::exception& error) {
  set({.state = State::failed, .kind = "internal", .message = error.what()});
}

}  // namespace rayrep::tool
