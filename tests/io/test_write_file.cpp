// Writing all of a file or nothing, and finding out beforehand whether that can work.

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <functional>
#include <sstream>
#include <string>
#include <vector>

#include "rayrep/base/error.h"
#include "rayrep/io/mesh_io.h"
#include "rayrep/io/write_file.h"
#include "solids.h"

namespace rayrep {
namespace {

namespace fs = std::filesystem;

class WriteFile : public ::testing::Test {
protected:
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "rayrep-write-file-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name;
  }
  void TearDown() override { fs::remove_all(folder_); }

  fs::path put(const std::string& name, const std::string& text, mode_t mode) const {
    const fs::path path = folder_ / name;
    std::ofstream(path) << text;
    ::chmod(path.c_str(), mode);
    return path;
  }
  static std::string slurp(const fs::path& path) {
    std::ostringstream text;
    text << std::ifstream(path).rdbuf();
    return text.str();
  }
  static mode_t mode_of(const fs::path& path) {
    struct stat info {};
    return ::stat(path.c_str(), &info) == 0 ? info.st_mode & 07777 : 0;
  }
  std::size_t entries() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
  }
  /// The message of the Error{write} that `action` must end in.
  static std::string refused(const std::function<void()>& action) {
    try {
      action();
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::write) << error.what();
      return error.what();
    }
    ADD_FAILURE() << "nothing thrown";
    return "";
  }

  fs::path folder_;
};

TEST_F(WriteFile, WhatCannotBeWrittenIsFoundBeforehand) {
  const auto expect = [&](const fs::path& path, const char* part) {
    // What require_writable says is what writing would have said, or it is stricter.
    for (const std::string& message : {refused([&] { require_writable(path); }), refused([&] { PendingFile pending(path); })}) {
      EXPECT_NE(message.find(part), std::string::npos) << message;
      EXPECT_NE(message.find(path.string()), std::string::npos) << message;
    }
  };
  expect(folder_ / "no" / "a.stl", "No such file or directory");
  expect(put("file", "x", 0644) / "a.stl", "Not a directory");
  fs::create_directory(folder_ / "folder.stl");
  expect(folder_ / "folder.stl", "Is a directory");
  expect(folder_ / "", "Is a directory");
  expect(folder_ / (std::string(252, 'x') + ".stl"), "File name too long");
  ASSERT_EQ(::mkfifo((folder_ / "pipe.stl").c_str(), 0600), 0);
  expect(folder_ / "pipe.stl", "device or a pipe");
  expect("/dev/null", "device or a pipe");
  fs::create_symlink("loop.stl", folder_ / "loop.stl");
  expect(folder_ / "loop.stl", "symbolic links");
  fs::create_symlink("no/a.stl", folder_ / "astray.stl");
  expect(folder_ / "astray.stl", "No such file or directory");
  if (geteuid() == 0) return;  // root may write anywhere
  expect(put("read_only.stl", "x", 0444), "Permission denied");
  expect("/proc/a.stl", "Permission denied");
}

TEST_F(WriteFile, WhatCanBeWrittenIsLeftAlone) {
  const fs::path old = put("old.stl", "old", 0640);
  fs::create_symlink("old.stl", folder_ / "link.stl");
  fs::create_symlink("new.stl", folder_ / "to_nothing.stl");
  const std::size_t before = entries();
  for (const fs::path& path :
       {old, folder_ / "link.stl", folder_ / "to_nothing.stl", folder_ / "new.stl", folder_ / (std::string(251, 'y') + ".stl")}) {
    EXPECT_NO_THROW(require_writable(path)) << path;
    EXPECT_NO_THROW(PendingFile pending(path)) << path;
  }
  EXPECT_NO_THROW(require_writable("in_the_current_folder.stl"));
  EXPECT_EQ(entries(), before);
  EXPECT_EQ(slurp(old), "old");
  EXPECT_EQ(mode_of(old), 0640u);
}

TEST_F(WriteFile, LinksStayLinksAndPermissionsStay) {
  for (const mode_t mode : {0600u, 0644u, 0755u}) {
    fs::create_directory(folder_ / "elsewhere");
    const fs::path real = put("elsewhere/real.obj", "old", mode);
    fs::create_symlink("elsewhere/real.obj", folder_ / "link.obj");
    fs::create_symlink(folder_ / "link.obj", folder_ / "twice.obj");
    write_text_file(folder_ / "twice.obj", "new");
    EXPECT_EQ(slurp(real), "new");
    PendingFile pending(folder_ / "twice.obj");
    pending.write(test::delivery(test::box({0, 0, 0}, {1, 2, 3})));
    EXPECT_EQ(mode_of(pending.path()), mode);  // never wider than what it replaces
    EXPECT_EQ(slurp(real), "new");
    pending.commit();
    EXPECT_EQ(read_mesh(real).mesh.triangles.size(), 12u);
    EXPECT_EQ(mode_of(real), mode);
    EXPECT_TRUE(fs::is_symlink(folder_ / "link.obj"));
    EXPECT_TRUE(fs::is_symlink(folder_ / "twice.obj"));
    EXPECT_EQ(entries(), 3u);
    fs::remove_all(folder_ / "elsewhere");
    // A link to what is gone makes it anew.
    fs::create_directory(folder_ / "elsewhere");
    write_text_file(folder_ / "link.obj", "anew");
    EXPECT_EQ(slurp(real), "anew");
    fs::remove_all(folder_ / "elsewhere");
    fs::remove(folder_ / "link.obj");
    fs::remove(folder_ / "twice.obj");
  }
}

TEST_F(WriteFile, WhatKilledRunsHaveLeftIsRemovedWhenItIsOld) {
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) _exit(0);
  ASSERT_EQ(waitpid(child, nullptr, 0), child);
  const std::string dead = std::to_string(child);
  const std::string living = std::to_string(getppid());
  const auto hour_ago = fs::file_time_type::clock::now() - std::chrono::hours(1);
  const std::vector<std::string> gone = {".rayrep-" + dead + "-0.stl", ".rayrep-" + dead + "-12", ".rayrep-" + dead + "-3.json"};
  const std::vector<std::string> kept = {".rayrep-" + living + "-0.stl", ".rayrep-" + dead + ".stl", "rayrep-" + dead + "-0.stl",
                                         ".rayrep-" + dead + "-x.stl",   ".rayrep--1-0.stl",         ".rayrep-" + dead + "-0x.stl"};
  for (const auto& names : {gone, kept})
    for (const std::string& name : names) fs::last_write_time(put(name, "", 0600), hour_ago);
  fs::create_directory(folder_ / (".rayrep-" + dead + "-7"));
  fs::create_symlink("elsewhere", folder_ / (".rayrep-" + dead + "-8"));
  const fs::path young = put(".rayrep-" + dead + "-1.stl", "", 0600);
  const std::size_t before = entries();
  remove_abandoned(folder_ / "no" / "such.stl", std::time(nullptr));
  remove_abandoned(folder_ / "out.stl", std::time(nullptr) - 7200);
  EXPECT_EQ(entries(), before);
  remove_abandoned(folder_ / "out.stl", std::time(nullptr) - 1800);
  EXPECT_EQ(entries(), before - gone.size());
  for (const std::string& name : kept) EXPECT_TRUE(fs::exists(folder_ / name)) << name;
  EXPECT_TRUE(fs::exists(young));

  PendingFile pending(folder_ / "out.stl");
  pending.write(test::delivery(test::box({0, 0, 0}, {1, 2, 3})));
  EXPECT_TRUE(fs::exists(pending.path()));
  remove_unfinished(folder_ / "other.stl");
  EXPECT_FALSE(fs::exists(pending.path()));
  EXPECT_EQ(entries(), before - gone.size());
}

TEST_F(WriteFile, StreamsAreWrittenToAndNotReplaced) {
  const fs::path path = put("stream", "first ", 0644);
  const int fd = ::open(path.c_str(), O_WRONLY | O_APPEND);
  for (const char* folder : {"/dev/fd/", "/proc/self/fd/", "/dev/../dev/fd/"}) {
    const fs::path name = folder + std::to_string(fd);
    EXPECT_TRUE(is_stream(name));
    write_text_file(name, "more ");
    EXPECT_NE(refused([&] { require_writable(name); }).find("not a file"), std::string::npos);
  }
  ::close(fd);
  EXPECT_EQ(slurp(path), "first more more more ");
  refused([&] { write_text_file("/dev/fd/" + std::to_string(fd), "x"); });  // closed
  for (const char* name : {"/dev/stdout", "/dev/stderr", "/dev/null", "/dev/full"}) EXPECT_TRUE(is_stream(name)) << name;
  for (const fs::path& name : {path, folder_, folder_ / "nothing", fs::path("stdout"), fs::path("/dev/fd/"), fs::path("/dev/fd/x")})
    EXPECT_FALSE(is_stream(name)) << name;
  refused([] { write_text_file("/dev/full", "x"); });
}

TEST_F(WriteFile, APendingFileIsJudgedBeforeItHasItsName) {
  const fs::path target = put("body.stl", "precious", 0644);
  {
    PendingFile pending(target);
    pending.write(test::delivery(test::box({0, 0, 0}, {1, 2, 3})));
    EXPECT_EQ(pending.path().extension(), ".stl");
    EXPECT_EQ(pending.path().filename().string().front(), '.');
    EXPECT_EQ(read_mesh(pending.path()).mesh.triangles.size(), 12u);
    pending.write(test::delivery(test::box({0, 0, 0}, {1, 2, 4})));  // again
    EXPECT_EQ(entries(), 2u);
  }
  EXPECT_EQ(slurp(target), "precious");  // without commit()
  EXPECT_EQ(entries(), 1u);
  {
    PendingFile pending(target);
    EXPECT_NE(refused([&] { pending.write(test::delivery(Mesh{})); }).find("'" + target.string() + "'"), std::string::npos);
    PendingFile other(target);  // two at a time do not meet
    pending.write(test::delivery(test::box({0, 0, 0}, {1, 2, 3})));
    other.write(test::delivery(test::box({0, 0, 0}, {1, 2, 4})));
    EXPECT_NE(pending.path(), other.path());
    pending.commit();
  }
  EXPECT_EQ(bounding_box(read_mesh(target).mesh).max().z(), 3);
  EXPECT_EQ(entries(), 1u);
  // The longest name there is.
  PendingFile longest(folder_ / (std::string(251, 'y') + ".stl"));
  longest.write(test::delivery(test::box({0, 0, 0}, {1, 2, 3})));
  longest.commit();
  EXPECT_EQ(entries(), 2u);
}

}  // namespace
}  // namespace rayrep
