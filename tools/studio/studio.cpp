#include "studio.h"

#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <iostream>
#include <iterator>
#include <optional>
#include <string>
#include <thread>

#include "interrupt.h"
#include "rayrep/base/child_process.h"
#include "rayrep/base/error.h"
#include "rayrep/io/write_file.h"
#include "server.h"
#include "session.h"

namespace rayrep::tool {
namespace {

bool has_display() {
  for (const char* name : {"DISPLAY", "WAYLAND_DISPLAY"})
    if (const char* value = std::getenv(name); value && *value) return true;
  return false;
}

/// Opens it by way of a file that only this user can read, as the words of a command line are for everybody on this computer to
/// see. The browser goes on when the studio ends: setsid gives it a session of its own, and is waited for until it has.
/// @returns false when there is no way to
bool is_opened(const std::string& address, const std::filesystem::path& folder, const std::function<bool()>& cancelled) {
  constexpr double kMost_s = 5;  // where the browser begins with it, xdg-open ends with the browser
  if (!has_display()) return false;
  const std::filesystem::path page = folder / "open.html";
  std::ofstream(page) << "<!doctype html><meta charset=\"utf-8\"><meta http-equiv=\"refresh\" content=\"0; url=" << address
                      << "\">\n";
  const ProgramCall call{.program = "setsid",
                         .arguments = {"--fork", "--wait", "xdg-open", page.string()},
                         .folder = folder,
                         .output = "/dev/null",
                         .errors = {}};
  try {
    const Ended ended = run_program(call, kMost_s, {.stage = {}, .cancelled = cancelled});
    return ended.how == Ended::How::took_too_long || (ended.how == Ended::How::exited && ended.code == 0);
  } catch (const Error& error) {
    if (error.code() != ErrorCode::interrupted) throw;
    return true;  // nobody is there to be told
  }
}

void load_named(const Options& options, Session& session, const std::function<bool()>& cancelled) {
  if (options.input.empty()) return;
  if (options.input.extension() == ".json") return session.load_scene(options.input, {.stage = {}, .cancelled = cancelled});
  std::ifstream in(options.input, std::ios::binary);
  std::error_code ignored;
  if (!in.is_open() || std::filesystem::is_directory(options.input, ignored))
    throw Error(ErrorCode::input, "Cannot read '" + options.input.string() + "'.");
  const std::string bytes{std::istreambuf_iterator<char>(in), {}};
  try {
    session.load(options.input.filename().string(), bytes);
  } catch (const Error& error) {
    throw Error(error.code(), session.told(error.what()));
  }
}

}  // namespace

void run_studio(const Options& options, const std::function<bool()>& cancelled) {
  std::optional<TemporaryFolder> folder{std::in_place};
  clean_up_folder(folder->path());
  Session session(options, folder->path());
  load_named(options, session, cancelled);
  Server server(session, options.studio);
  server.start();
  std::cout << "studio: " << server.address() << std::endl;
  if (!options.studio.no_open && !is_opened(server.address(), folder->path(), cancelled))
    std::cout << "Open this address in a browser on this computer." << std::endl;
  std::cout << "Ctrl-C ends it." << std::endl;
  while (!cancelled()) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    if (server.has_ended()) throw Error(ErrorCode::internal, "The studio cannot listen any more.");
  }
  session.end();
  folder.reset();
  // A client that says nothing holds its thread for seconds more: nobody waits for it.
  _exit(0);
}

}  // namespace rayrep::tool
