#include <atomic>
#include <csignal>
#include <exception>
#include <iostream>
#include <new>

#include "options.h"
#include "rayrep/base/error.h"
#include "run.h"

namespace {

std::atomic<bool> interrupted{false};
static_assert(std::atomic<bool>::is_always_lock_free, "used in a signal handler");

/// The first signal asks the computation to stop; a second one ends the process.
void on_signal(int signal) {
  interrupted = true;
  std::signal(signal, SIG_DFL);
}

}  // namespace

int main(int argc, char** argv) {
  std::signal(SIGINT, on_signal);
  std::signal(SIGTERM, on_signal);
  std::signal(SIGXFSZ, SIG_IGN);  // a full quota is then an error of the write
  bool suggest = false;
  try {
    const rayrep::tool::Options options = rayrep::tool::parse_command_line(argc, argv);
    suggest = options.suggest;
    rayrep::tool::run(options, [] { return interrupted.load(); });
    return 0;
  } catch (const rayrep::Error& error) {
    std::cerr << "rayrep: " << error.what() << "\n";
    if (suggest)
      for (const std::string& remedy : error.remedies()) std::cout << rayrep::tool::remedied(argc, argv, remedy) << "\n";
    return static_cast<int>(error.code());
  } catch (const std::bad_alloc&) {
    std::cerr << "rayrep: Out of memory: try a lower --resolution.\n";
    return static_cast<int>(rayrep::ErrorCode::internal);
  } catch (const std::exception& error) {
    std::cerr << "rayrep: Internal error: " << error.what() << "\n";
    return static_cast<int>(rayrep::ErrorCode::internal);
  }
}
