#include <fcntl.h>
#include <unistd.h>

#include <cstdlib>
#include <exception>
#include <iostream>
#include <new>
#include <string>
#include <string_view>
#include <vector>

#include "interrupt.h"
#include "options.h"
#include "rayrep/base/error.h"
#include "run.h"

namespace {

using rayrep::tool::is_interrupted;
using rayrep::tool::printable;

constexpr const char* kOutOfMemory =
    "Out of memory: try a lower --resolution or a mesh of fewer triangles, or let it have more (ulimit -v).";

/// What TBB and the standard library say where there is no memory for another thread.
bool lacks_threads(const std::exception& error) {
  const std::string_view text = error.what();
  return text.find("pthread_create") != text.npos || text.find("Resource temporarily unavailable") != text.npos;
}

/// Of an exception that can be caught nowhere, as in a thread that could not be started.
[[noreturn]] void on_terminate() {
  std::string text = "Internal error: it ended unexpectedly.";
  try {
    if (const std::exception_ptr error = std::current_exception()) std::rethrow_exception(error);
  } catch (const std::bad_alloc&) {
    text = kOutOfMemory;
  } catch (const std::exception& error) {
    text = lacks_threads(error) ? kOutOfMemory : "Internal error, or out of memory: " + printable(error.what());
  } catch (...) {
  }
  text = "rayrep: " + text + "\n";
  if (::write(STDERR_FILENO, text.data(), text.size()) < 0) {
    // there is nobody to tell
  }
  _exit(static_cast<int>(rayrep::ErrorCode::internal));
}

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
    rayrep::Search search;
    search.found = [&](const rayrep::Suggestion& found) {
      const std::string line = rayrep::tool::shell_line(rayrep::tool::suggested(argc, argv, found));
      std::cerr << "  " << found.change << ":  " << printable(line) << std::endl;
      if (options.suggest) std::cout << line << std::endl;
    };
    const rayrep::Advice advice = rayrep::tool::advise(options, is_interrupted, search);
    if (advice.suggestions.empty())
      std::cerr << "rayrep: Nothing does: tried " << advice.tried << "." << std::endl;
    else
      std::cerr << "rayrep: Each of these was run and verified." << std::endl;
  } catch (const rayrep::Error&) {
    // The refusal stands, with or without advice.
  }
}

/// Whether it can be made with a change, which is told first.
bool is_run_with(int argc, char** argv, const rayrep::Suggestion& change) {
  const std::vector<std::string> words = rayrep::tool::suggested(argc, argv, change);
  std::vector<const char*> arguments;
  for (const std::string& word : words) arguments.push_back(word.c_str());
  try {
    rayrep::tool::Options changed = rayrep::tool::parse_command_line(static_cast<int>(arguments.size()), arguments.data());
    changed.changed = change.change;
    changed.outside = change.outside;
    changed.attempt = true;
    if (!changed.quiet)
      std::cerr << "rayrep: With a change that --allow lets: " << change.change << ". The same as  "
                << printable(rayrep::tool::shell_line(words)) << std::endl;
    rayrep::tool::run(changed, is_interrupted);
    return true;
  } catch (const rayrep::Error& error) {
    using rayrep::ErrorCode;
    if (error.code() == ErrorCode::interrupted || error.code() == ErrorCode::write) throw;
    return false;
  }
}

/// Makes it with the least change that --allow lets. @throws Error{goal} when none does
void run_changed(int argc, char** argv, const rayrep::tool::Options& options, const std::string& refusal) {
  if (!options.quiet) std::cerr << "rayrep: " << printable(refusal) << std::endl;
  rayrep::Search search;
  search.kinds = options.allow;
  search.first_only = true;
  search.deliver = [argc, argv](const rayrep::Suggestion& change) { return is_run_with(argc, argv, change); };
  const rayrep::Advice advice = rayrep::tool::advise(options, is_interrupted, search);
  if (advice.suggestions.empty())
    throw rayrep::Error(rayrep::ErrorCode::goal, (options.quiet ? refusal + " " : "") +
                                                     "Nothing that --allow lets change does: tried " + advice.tried + ".");
}

/// What is closed of standard input, output and error is kept from becoming one of the files that are opened: writing to it fails.
void reserve_standard_streams() {
  for (int fd = 0; fd < 3; ++fd)
    if (::fcntl(fd, F_GETFD) < 0 && ::open("/dev/null", O_RDONLY) < 0) return;
}

}  // namespace

int main(int argc, char** argv) {
  reserve_standard_streams();
  std::set_terminate(on_terminate);
  rayrep::tool::handle_signals();
  try {
    const rayrep::tool::Options options = rayrep::tool::parse_command_line(argc, argv);
    try {
      rayrep::tool::run(options, is_interrupted);
    } catch (const rayrep::Error& error) {
      if (!can_be_advised(options, error)) throw;
      if (!options.allow.empty() && error.code() == rayrep::ErrorCode::goal) {
        run_changed(argc, argv, options, error.what());
        return 0;
      }
      std::cerr << "rayrep: " << printable(error.what()) << std::endl;
      rayrep::tool::interrupted_with(static_cast<int>(error.code()));
      advise(argc, argv, options);
      return static_cast<int>(error.code());
    }
    return 0;
  } catch (const rayrep::Error& error) {
    std::cerr << "rayrep: " << printable(error.what()) << "\n";
    return error.code() == rayrep::ErrorCode::interrupted ? rayrep::tool::interrupted_exit_code() : static_cast<int>(error.code());
  } catch (const std::bad_alloc&) {
    std::cerr << "rayrep: " << kOutOfMemory << "\n";
    return static_cast<int>(rayrep::ErrorCode::internal);
  } catch (const std::exception& error) {
    std::cerr << "rayrep: " << (lacks_threads(error) ? kOutOfMemory : "Internal error: " + printable(error.what())) << "\n";
    return static_cast<int>(rayrep::ErrorCode::internal);
  }
}
