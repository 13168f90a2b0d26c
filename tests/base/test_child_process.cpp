// Programs that run beside this one.

#include <gtest/gtest.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <string>

#include "rayrep/base/child_process.h"
#include "rayrep/base/error.h"
#include "rayrep/io/write_file.h"

namespace rayrep {
namespace {

ProgramCall shell(const TemporaryFolder& folder, const std::string& script) {
  return {"sh", {"-c", script}, folder.path(), folder.path() / "output", folder.path() / "errors"};
}

TEST(ChildProcess, TellsHowItEnded) {
  const TemporaryFolder folder;
  const Ended ended = run_program(shell(folder, "echo out; echo said >&2; exit 7"), 60, {});
  EXPECT_EQ(ended.how, Ended::How::exited);
  EXPECT_EQ(ended.code, 7);
  EXPECT_EQ(ended.said, "said");
  EXPECT_GT(ended.peak_memory_mb, 0);
  std::ifstream output(folder.path() / "output");
  std::string word;
  output >> word;
  EXPECT_EQ(word, "out");
  const Ended killed = run_program(shell(folder, "kill -SEGV $$"), 60, {});
  EXPECT_EQ(killed.how, Ended::How::killed_by_signal);
  EXPECT_EQ(killed.code, SIGSEGV);
  EXPECT_EQ(run_program({"/no/such/program", {}, {}, folder.path() / "output", {}}, 60, {}).how, Ended::How::not_found);
}

TEST(ChildProcess, DoesNotOutliveItsTimeItsCallerOrItsPatience) {
  const TemporaryFolder folder;
  EXPECT_EQ(run_program(shell(folder, "sleep 60"), 0.2, {}).how, Ended::How::took_too_long);
  const Progress impatient{.stage = {}, .cancelled = [] { return true; }};
  EXPECT_THROW(run_program(shell(folder, "sleep 60"), 60, impatient), Error);
  // Nor does what it has started: it would make a file after a second.
  { const ChildProcess left(shell(folder, "(sleep 1; touch late) & wait")); }
  run_program(shell(folder, "sleep 1.5"), 60, {});
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "late"));
}

TEST(ChildProcess, TheFirstThatEndsIsFound) {
  const TemporaryFolder folder;
  ChildProcess slow({"sleep", {"60"}, {}, folder.path() / "slow", {}});
  ChildProcess quick({"sleep", {"0.1"}, {}, folder.path() / "quick", {}});
  while (!quick.has_ended()) ChildProcess::wait_for_any({&slow, &quick}, 5);
  EXPECT_FALSE(slow.has_ended());
  slow.stop();
  EXPECT_TRUE(slow.has_ended());
  EXPECT_EQ(slow.ended().how, Ended::How::took_too_long);
}

}  // namespace
}  // namespace rayrep
