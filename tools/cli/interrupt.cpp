#include "interrupt.h"

#include <semaphore.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <csignal>
#include <ctime>
#include <mutex>
#include <string>
#include <system_error>
#include <thread>

#include "rayrep/io/write_file.h"

namespace rayrep::tool {
namespace {

std::atomic<int> signal_caught{0};
static_assert(std::atomic<int>::is_always_lock_free, "used in a signal handler");
sem_t wake;

std::mutex ending;  // held while the process must not be ended, and by whom ends it
std::vector<std::filesystem::path> unfinished_beside;
std::filesystem::path folder_to_remove;
int results = 0;
int known_exit_code = 0;

void on_signal(int signal) {
  const int error = errno;
  int none = 0;
  signal_caught.compare_exchange_strong(none, signal);
  sem_post(&wake);
  errno = error;
}

/// Waits for the signal, then for the computation to end or for a second signal.
void watch() {
  while (sem_wait(&wake) != 0) {
  }
  timespec until{};
  clock_gettime(CLOCK_REALTIME, &until);
  until.tv_nsec += 800'000'000;
  until.tv_sec += until.tv_nsec / 1'000'000'000;
  until.tv_nsec %= 1'000'000'000;
  while (sem_timedwait(&wake, &until) != 0 && errno == EINTR) {
  }
  ending.lock();
  for (const auto& output : unfinished_beside) remove_unfinished(output);
  std::error_code ignored;
  if (!folder_to_remove.empty()) std::filesystem::remove_all(folder_to_remove, ignored);
  const std::string text = known_exit_code != 0 ? ""
                           : results == 0       ? "rayrep: Interrupted; nothing was written.\n"
                                                : "rayrep: Interrupted; what was delivered before is done.\n";
  if (::write(STDERR_FILENO, text.data(), text.size()) < 0) {
    // there is nobody to tell
  }
  _exit(interrupted_exit_code());
}

}  // namespace

void handle_signals() {
  sem_init(&wake, 0, 0);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    struct sigaction action {};
    // What was ignored when the process began, as by nohup, stays so.
    if (sigaction(signal, nullptr, &action) == 0 && action.sa_handler == SIG_IGN) continue;
    action = {};
    action.sa_handler = on_signal;
    action.sa_flags = SA_RESTART;
    sigaction(signal, &action, nullptr);
  }
  std::signal(SIGXFSZ, SIG_IGN);  // a full quota is then an error of the write
  std::signal(SIGPIPE, SIG_IGN);  // and so is a reader who has gone
  try {
    std::thread(watch).detach();
  } catch (const std::system_error&) {
    // Without memory for a thread the computation alone looks at the signal.
  }
}

bool is_interrupted() { return signal_caught.load() != 0; }

int interrupted_exit_code() { return known_exit_code != 0 ? known_exit_code : 128 + signal_caught.load(); }

void clean_up_beside(const std::vector<std::filesystem::path>& outputs) {
  const std::lock_guard lock(ending);
  unfinished_beside.insert(unfinished_beside.end(), outputs.begin(), outputs.end());
}

void clean_up_folder(const std::filesystem::path& folder) {
  const std::lock_guard lock(ending);
  folder_to_remove = folder;
}

void interrupted_with(int exit_code) {
  const std::lock_guard lock(ending);
  known_exit_code = exit_code;
}

Uninterrupted::Uninterrupted(bool last) : last_(last) { ending.lock(); }

Uninterrupted::~Uninterrupted() {
  ++results;
  if (!last_) ending.unlock();
}

}  // namespace rayrep::tool
