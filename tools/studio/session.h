#pragma once

#include <atomic>
#include <filesystem>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "child_run.h"
#include "goals.h"
#include "input.h"
#include "latest.h"
#include "rayrep/make/preview.h"
#include "scene_session.h"

namespace rayrep::tool {

/// Why a request is refused that is none of the command's errors.
struct Refused : std::runtime_error {
  Refused(int http_status, std::string short_name, const std::string& message)
      : std::runtime_error(message), status(http_status), kind(std::move(short_name)) {}
  int status;
  std::string kind;
};

/// What the studio holds, and what it answers: one mesh, the last one loaded; the latest look at it; one run. Answers are JSON, see
/// tools/studio/README.md. Every member may be called from several threads at once.
/// @throws Refused; Error as the command does
class Session {
public:
  /// @param folder  an empty one: gets all files
  Session(const Options& options, std::filesystem::path folder);

  /// Of the page's block rayrep-studio.
  std::string start() const;
  std::string load(const std::string& name, const std::string& bytes);
  /// Of a scene in place of a mesh, before anything is asked.
  void load_scene(const std::filesystem::path& path, const Progress& progress);
  SceneSession& scene();
  /// The bytes of the mesh as it was loaded.
  std::string mesh_bytes() const;
  std::string preview(const std::string& wanted);

  /// Of a mesh what is wanted, of a scene an edit: rayrep balance.
  std::string begin_run(const std::string& wanted);
  std::string run_status();
  void cancel_run();
  std::string result();

  struct Download {
    std::string name;
    std::string bytes;
  };
  Download download(const std::string& name);

  /// Ends what is going on.
  void end();

  /// A message without where the files are here.
  std::string told(const std::string& message) const;

private:
  /// The mesh of some settings, as read, and what was kept of looks at it.
  struct Reading {
    std::string key;  ///< the settings it depends on
    ReadMesh mesh;
    int bodies = 0;
    std::unique_ptr<Previewer> previewer;
  };
  struct Document {
    std::filesystem::path path;
    double factor = 1;  ///< from the file's numbers to those that are shown
    Reading last;
  };
  /// What everybody may ask for at any time.
  struct Loaded {
    std::filesystem::path path;
    std::string json;  ///< what loading it was answered
  };
  struct Run {
    int number = 0;
    Wanted wanted;
    std::string mesh;              ///< its name, or that of the scene
    std::string output;            ///< name of the body
    std::filesystem::path folder;  ///< with its files and nothing else
    std::unique_ptr<ChildRun> child;
    std::unique_ptr<ChildRun> other;  ///< the same with another format, once that was asked for
  };

  std::filesystem::path cleared_folder();
  std::string begin_balance(const std::string& edit);
  static std::vector<std::string> balanced_files(const Run& run);
  Download balanced_download(const std::string& name);
  Loaded loaded() const;
  static Reading read_anew(const Options& options, const Progress& progress);
  Reading& reading_for(const Options& options, const Progress& progress);
  std::string looked(const Wanted& wanted, Options options, const Progress& progress);
  std::vector<std::string> words_to_write(const Run& run, const std::string& output) const;
  Run& finished_run();
  static std::vector<std::string> files_of(const Run& run);
  std::filesystem::path in_other_format();

  const Options& options_;
  std::filesystem::path folder_;
  std::atomic<bool> ended_ = false;

  std::unique_ptr<SceneSession> scene_;
  Latest latest_;                     ///< who may use these two
  std::optional<Document> document_;  ///< the last mesh that could be read
  int loads_ = 0;
  mutable std::mutex telling_;
  std::optional<Loaded> loaded_;  ///< of document_

  std::mutex running_;
  int runs_ = 0;
  std::optional<Run> run_;
};

}  // namespace rayrep::tool
