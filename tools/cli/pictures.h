#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "options.h"
#include "rayrep/rayrep.h"

namespace rayrep::tool {

/// Finds out before the work that a plane does not meet the body. @throws Error{usage}
void require_planes_meet(const Options& options, const Mesh& mesh);

/// What --section and --picture ask for, drawn, and not yet written.
class Pictures {
public:
  /// @throws Error{usage} for a plane that does not meet the body
  void draw(const Options& options, const BodyPicture& what);
  /// All of them, whole. @throws Error{write}
  void write() const;
  /// "pictures: a.svg, b.png" as a line; empty without any.
  std::string told() const;

private:
  struct Drawn {
    std::filesystem::path path;
    std::string bytes;
  };
  std::vector<Drawn> drawn_;
};

}  // namespace rayrep::tool
