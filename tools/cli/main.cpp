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

bool is_interrupted() { return interrupted.load(); }

/// A hollowing that was refused for its goal; on request one that was refused for its mesh.
bool can_be_advised(const rayrep::tool::Options& options, const rayrep::Error& error) {
  return options.command == rayrep::tool::Command::hollow && !options.each &&
         (error.code() == rayrep::ErrorCode::goal || (options.suggest && error.code() == rayrep::ErrorCode::input));
}

/// What would do instead of a hollowing that was refused: told beside the message, and with --suggest as command lines
/// on standard output.
void advise(int argc, char** argv, const rayrep::tool::Options& options) {
  if (!options.suggest && (options.quiet || options.no_advice)) return;
  std::cerr << "rayrep: Looking for what would do (Ctrl-C stops that) ..." << std::endl;
  try {
    const rayrep::Advice advice = rayrep::tool::advise(options, is_interrupted, [&](const rayrep::Suggestion& found) {
      const std::string line = rayrep::tool::suggested(argc, argv, found);
      std::cerr << "  " << found.change << ":  " << line << std::endl;
      if (options.suggest) std::cout << line << std::endl;
    });
    if (advice.suggestions.empty())
      std::cerr << "rayrep: Nothing does: tried " << advice.tried << "." << std::endl;
    else
      std::cerr << "rayrep: Each of these was run and verified." << std::endl;
  } catch (const rayrep::Error&) {
    // The refusal stands, with or without advice.
  }
}

}  // namespace

int main(int argc, char** argv) {
  std::signal(SIGINT, on_signal);
  std::signal(SIGTERM, on_signal);
  std::signal(SIGXFSZ, SIG_IGN);  // a full quota is then an error of the write
  try {
    const rayrep::tool::Options options = rayrep::tool::parse_command_line(argc, argv);
    try {
      rayrep::tool::run(options, is_interrupted);
    } catch (const rayrep::Error& error) {
      if (!can_be_advised(options, error)) throw;
      std::cerr << "rayrep: " << error.what() << std::endl;
      advise(argc, argv, options);
      return static_cast<int>(error.code());
    }
    return 0;
  } catch (const rayrep::Error& error) {
    std::cerr << "rayrep: " << error.what() << "\n";
    return static_cast<int>(error.code());
  } catch (const std::bad_alloc&) {
    std::cerr << "rayrep: Out of memory: try a lower --resolution.\n";
    return static_cast<int>(rayrep::ErrorCode::internal);
  } catch (const std::exception& error) {
    std::cerr << "rayrep: Internal error: " << error.what() << "\n";
    return static_cast<int>(rayrep::ErrorCode::internal);
  }
}
