#include "print/child_process.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <ctime>
#include <fstream>
#include <system_error>

#include "base/text.h"
#include "rayrep/base/error.h"

extern char** environ;

namespace rayrep::detail {
namespace {

constexpr long kPollNs = 20'000'000;

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

/// A process group that does not outlive the scope.
class Group {
public:
  explicit Group(pid_t leader) : leader_(leader) {}
  ~Group() { kill(); }
  Group(const Group&) = delete;
  Group& operator=(const Group&) = delete;

  /// Waits for one poll. @returns true once the leader has ended
  bool ended(int& status) {
    const pid_t got = ::waitpid(leader_, &status, WNOHANG);
    if (got == 0) {
      const timespec pause{0, kPollNs};
      ::nanosleep(&pause, nullptr);
      return false;
    }
    reaped_ = true;
    return true;
  }
  void kill() {
    ::kill(-leader_, SIGKILL);
    if (reaped_) return;
    int status = 0;
    while (::waitpid(leader_, &status, 0) < 0 && errno == EINTR) {
    }
    reaped_ = true;
  }

private:
  pid_t leader_;
  bool reaped_ = false;
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

}  // namespace

Ended run_program(const Command& command, const Progress& progress) {
  std::vector<char*> arguments;
  std::string program = command.program;
  std::vector<std::string> words = command.arguments;
  arguments.push_back(program.data());
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);

  SpawnSettings settings;
  const std::string output = (command.folder / "output").string();
  posix_spawn_file_actions_addopen(&settings.files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&settings.files, STDOUT_FILENO, output.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  posix_spawn_file_actions_adddup2(&settings.files, STDOUT_FILENO, STDERR_FILENO);
  posix_spawn_file_actions_addchdir_np(&settings.files, command.folder.c_str());
  sigset_t none;
  sigemptyset(&none);
  sigset_t all;
  sigfillset(&all);
  posix_spawnattr_setsigmask(&settings.attributes, &none);
  posix_spawnattr_setsigdefault(&settings.attributes, &all);
  posix_spawnattr_setpgroup(&settings.attributes, 0);
  posix_spawnattr_setflags(&settings.attributes, POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);

  pid_t pid = 0;
  const int error = ::posix_spawnp(&pid, program.c_str(), &settings.files, &settings.attributes, arguments.data(), environ);
  if (error == ENOENT || error == EACCES || error == ENOEXEC || error == ENOTDIR)
    return {Ended::How::not_found, error, std::strerror(error)};
  if (error != 0) throw Error(ErrorCode::internal, concat("Cannot run '", program, "': ", std::strerror(error), "."));

  Group group(pid);
  int status = 0;
  const double polls = command.time_limit_s * 1e9 / kPollNs;
  for (double n = 0; !group.ended(status); ++n) {
    progress.check();
    if (n >= polls) {
      group.kill();
      return {Ended::How::took_too_long, 0, last_lines(output)};
    }
  }
  if (WIFEXITED(status)) return {Ended::How::exited, WEXITSTATUS(status), last_lines(output)};
  return {Ended::How::killed_by_signal, WTERMSIG(status), last_lines(output)};
}

}  // namespace rayrep::detail
