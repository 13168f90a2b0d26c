#pragma once

#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "latest.h"
#include "rayrep/base/progress.h"
#include "rayrep/motion/motion_check.h"
#include "rayrep/motion/scene.h"

namespace rayrep::tool {

/// A scene of parts that move, and looks at it after edits: what an edit does not touch is not looked at again. Every member may be
/// called from several threads at once.
class SceneSession {
public:
  /// @throws Error as read_scene and require_scene
  SceneSession(const std::filesystem::path& path, const MotionCheckOptions& options, const Progress& progress);

  /// {"data": ..., "blocks": ...} of the page, with nothing found yet.
  std::string start() const;

  /// Looks for collisions on ways as a page has them, and last for parts that overlap in its states.
  /// @param tell  takes what is known so far as JSON, without ends of lines, ever sharper; false: nobody listens any more
  /// @throws Error{usage} for ways that are none; Error{interrupted} when it was superseded by a later one
  void check(const std::string& edit, const std::function<bool(const std::string&)>& tell);

  /// How it rests in its states, of the parts as they are: balance_json.
  /// @throws Error{usage} where no state says how, or for ways that are none; Error{input} where parts overlap in a state;
  ///         Error{interrupted} when it was superseded by a later one
  std::string balance(const std::string& edit);

  /// The scene's file with these ways and states. @throws Error{usage}
  std::string file(const std::string& edit) const { return file(edit, path_); }
  /// As it is to lie elsewhere.
  std::string file(const std::string& edit, const std::filesystem::path& path) const;
  /// A scene whose parts lie beside it, to be put with these into a folder beside the first one.
  std::string file_with_parts(const std::filesystem::path& scene) const;
  std::string name() const { return path_.filename().string(); }

  void end() {
    latest_.end();
    judging_.end();
  }

private:
  Scene edited(const nlohmann::json& edit) const;
  const nlohmann::json& clashes(const Scene& scene, const Progress& progress);

  std::filesystem::path path_;
  MotionCheckOptions options_;
  Scene scene_;
  Latest latest_;  ///< who may use the checker
  MotionChecker checker_;
  Scene clashing_;                         ///< without ways, and
  std::optional<nlohmann::json> clashes_;  ///< what overlaps in its states
  Latest judging_;                         ///< the latest look at how it rests is the one that is wanted
};

}  // namespace rayrep::tool
