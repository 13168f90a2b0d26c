#include "rayrep/base/child_process.h"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <fstream>
#include <utility>

#include "base/text.h"
#include "rayrep/base/error.h"

extern char** environ;

namespace rayrep {
namespace {

constexpr double kPoll_s = 0.1;

/// posix_spawn's settings, which have to be given back.
struct SpawnSettings {
  posix_spawn_file_actions_t files;
  posix_spawnattr_t attributes;
  SpawnSettings() {
    posix_spawn_file_actions_init(&files);
    posix_spawnattr_init(&attributes);
  }
  ~SpawnSettings() {
    posix_spawn_file_actions_destroy(&files);
    posix_spawnattr_destroy(&attributes);
  }
  SpawnSettings(const SpawnSettings&) = delete;
  SpawnSettings& operator=(const SpawnSettings&) = delete;
};

std::string last_lines(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);)
    if (!line.empty() && line.find("[trace]") == std::string::npos) lines.push_back(line);
  constexpr std::size_t few = 4;
  std::string text;
  for (std::size_t n = lines.size() > few ? lines.size() - few : 0; n < lines.size(); ++n)
    text += (text.empty() ? "" : " / ") + lines[n].substr(0, 300);
  return text;
}

double seconds(const timeval& t) { return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec); }

/// Its process. @throws Error{internal}; 0 or less: minus errno of a program that is not there
pid_t spawned(const ProgramCall& call) {
  std::vector<char*> arguments;
  std::string program = call.program;
  std::vector<std::string> words = call.arguments;
  arguments.push_back(program.data());
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);

  constexpr int anew = O_WRONLY | O_CREAT | O_TRUNC;
  SpawnSettings settings;
  posix_spawn_file_actions_addopen(&settings.files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&settings.files, STDOUT_FILENO, call.output.c_str(), anew, 0600);
  if (call.errors.empty())
    posix_spawn_file_actions_adddup2(&settings.files, STDOUT_FILENO, STDERR_FILENO);
  else
    posix_spawn_file_actions_addopen(&settings.files, STDERR_FILENO, call.errors.c_str(), anew, 0600);
  if (!call.folder.empty()) posix_spawn_file_actions_addchdir_np(&settings.files, call.folder.c_str());
  sigset_t none;
  sigemptyset(&none);
  sigset_t all;
  sigfillset(&all);
  posix_spawnattr_setsigmask(&settings.attributes, &none);
  posix_spawnattr_setsigdefault(&settings.attributes, &all);
  posix_spawnattr_setpgroup(&settings.attributes, 0);
  posix_spawnattr_setflags(&settings.attributes, POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);

  pid_t process = 0;
  const int error = ::posix_spawnp(&process, program.c_str(), &settings.files, &settings.attributes, arguments.data(), environ);
  if (error == 0) return process;
  if (error == ENOENT || error == EACCES || error == ENOEXEC || error == ENOTDIR) return -error;
  throw Error(ErrorCode::internal, concat("Cannot run '", program, "': ", std::strerror(error), "."));
}

}  // namespace

ChildProcess::ChildProcess(ProgramCall call) : call_(std::move(call)) {
  process_ = spawned(call_);
  if (process_ > 0) {
    descriptor_ = static_cast<int>(::syscall(SYS_pidfd_open, process_, 0));
    return;
  }
  ended_ = {.how = Ended::How::not_found, .code = -process_, .said = std::strerror(-process_)};
  process_ = -1;
}

ChildProcess::~ChildProcess() {
  if (process_ > 0) kill();
  if (descriptor_ >= 0) ::close(descriptor_);
}

void ChildProcess::kill() {
  ::kill(-process_, SIGKILL);
  int status = 0;
  while (::waitpid(process_, &status, 0) < 0 && errno == EINTR) {
  }
  process_ = -1;
}

bool ChildProcess::has_ended() {
  if (process_ < 0) return true;
  int status = 0;
  rusage usage{};
  if (::wait4(process_, &status, WNOHANG, &usage) == process_) {
    ::kill(-process_, SIGKILL);  // what it has left behind
    process_ = -1;
    ended_.how = WIFEXITED(status) ? Ended::How::exited : Ended::How::killed_by_signal;
    ended_.code = WIFEXITED(status) ? WEXITSTATUS(status) : WTERMSIG(status);
    ended_.cpu_s = seconds(usage.ru_utime) + seconds(usage.ru_stime);
    ended_.peak_memory_mb = static_cast<double>(usage.ru_maxrss) / 1024;
    ended_.said = last_lines(said_in());
  }
  return process_ < 0;
}

void ChildProcess::stop() {
  if (process_ < 0) return;
  kill();
  ended_.how = Ended::How::took_too_long;
  ended_.said = last_lines(said_in());
}

void ChildProcess::wait_for_any(const std::vector<ChildProcess*>& children, double most_s) {
  std::vector<pollfd> ends;
  for (const ChildProcess* child : children) {
    if (child->process_ < 0) return;
    if (child->descriptor_ >= 0) ends.push_back({child->descriptor_, POLLIN, 0});
  }
  // Where there are no such descriptors it is looked at often.
  constexpr double often_s = 0.02;
  const double wait_s = ends.size() == children.size() ? most_s : std::min(often_s, most_s);
  ::poll(ends.data(), ends.size(), static_cast<int>(1000 * wait_s));
}

Ended run_program(const ProgramCall& call, double time_limit_s, const Progress& progress) {
  ChildProcess child(call);
  for (double waited_s = 0; !child.has_ended(); waited_s += kPoll_s) {
    progress.check();
    if (waited_s >= time_limit_s) child.stop();
    ChildProcess::wait_for_any({&child}, kPoll_s);
  }
  return child.ended();
}

}  // namespace rayrep
