#include <algorithm>
#include <cmath>

#include "io/mesh_io_detail.h"
#include "mesh/polygon.h"

namespace rayrep::detail {
namespace {

// Clipping ears can take time in the square of the corners: this many take seconds.
constexpr std::size_t kMaxCornersOfFace = 50000;

/// A face that is less flat than this is worth a note: its volume depends on the split visibly.
constexpr double kNoteworthy = 1e-3;

}  // namespace

void PolygonSoup::end_polygon() {
  const std::size_t begin = ends.empty() ? 0 : ends.back();
  if (corners.size() - begin >= 3) {
    ends.push_back(corners.size());
  } else {
    corners.resize(begin);
    ++dropped;
  }
}

MeshFile triangulated(const FileBytes& file, PolygonSoup&& soup, std::string format) {
  MeshFile result;
  result.format = std::move(format);
  result.polygons = soup.ends.size();
  result.mesh.vertices = std::move(soup.vertices);
  result.mesh.triangles.reserve(soup.corners.size() - 2 * soup.ends.size());
  std::size_t begin = 0;
  std::size_t bent = 0;
  double largest = 0;
  for (std::size_t i = 0; i < soup.ends.size(); begin = soup.ends[i++]) {
    const auto polygon = std::span<const int>(soup.corners).subspan(begin, soup.ends[i] - begin);
    if (polygon.size() > kMaxCornersOfFace)
      fail_read(file, concat("face ", i + 1),
                concat("a single face has ", polygon.size(), " corners; at most ", kMaxCornersOfFace,
                       " are supported. Triangulate the mesh in the program that made it."));
    const double bulge = append_triangulated(polygon, result.mesh);
    bent += bulge > kNoteworthy;
    largest = std::max(largest, bulge);
  }
  if (bent > 0)
    result.notes.push_back(concat(plural(bent, "face is", "faces are"), " not flat, by up to ", std::round(1000 * largest) / 10,
                                  " % of ", bent == 1 ? "its" : "their",
                                  " size: the surface and the volume depend on how they are split into triangles."));
  if (soup.dropped > 0)
    result.notes.push_back(plural(soup.dropped, "face of fewer than three corners was", "faces of fewer than three corners were") +
                           " ignored.");
  return result;
}

}  // namespace rayrep::detail
