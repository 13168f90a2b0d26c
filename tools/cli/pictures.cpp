#include "pictures.h"

namespace rayrep::tool {
namespace {

std::string bytes_of(const Drawing& drawing, const std::filesystem::path& path) {
  return ending_of(path) == ".png" ? to_png(drawing) : to_svg(drawing);
}

}  // namespace

void require_planes_meet(const Options& options, const Mesh& mesh) {
  for (const SectionFile& section : options.sections)
    if (section.plane.offset_mm) require_plane_meets(section.plane, mesh);
}

void Pictures::draw(const Options& options, const BodyPicture& what) {
  for (const SectionFile& section : options.sections)
    drawn_.push_back({section.path, bytes_of(section_drawing(what.after, section.plane), section.path)});
  if (options.picture.empty()) return;
  BodyPicture picture = what;
  if (!options.sections.empty()) picture.cut = options.sections.front().plane;
  drawn_.push_back({options.picture, bytes_of(body_drawing(picture), options.picture)});
}

void Pictures::write() const {
  for (const Drawn& picture : drawn_) write_text_file(picture.path, picture.bytes);
}

std::string Pictures::told() const {
  std::string line;
  for (const Drawn& picture : drawn_) line += (line.empty() ? "" : ", ") + picture.path.string();
  return line.empty() ? line : (drawn_.size() == 1 ? "picture: " : "pictures: ") + line + "\n";
}

}  // namespace rayrep::tool
