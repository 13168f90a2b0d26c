#include "report/packed_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <tuple>
#include <utility>
#include <vector>

#include "mesh/mesh_edges.h"

namespace rayrep::report_detail {
namespace {

using Key = std::uint64_t;
Key key(int from, int to) { return (static_cast<Key>(static_cast<std::uint32_t>(from)) << 32) | static_cast<std::uint32_t>(to); }

using Place = Eigen::Matrix<std::int64_t, 3, 1>;

/// Directed edges and the triangles that run them.
class Edges {
public:
  explicit Edges(const Mesh& mesh) {
    of_.reserve(3 * mesh.triangles.size());
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
      for (int k = 0; k < 3; ++k) of_.emplace_back(key(mesh.triangles[t][k], mesh.triangles[t][(k + 1) % 3]), static_cast<int>(t));
    std::sort(of_.begin(), of_.end());
  }
  auto end() const { return of_.end(); }
  auto first(Key edge) const { return std::lower_bound(of_.begin(), of_.end(), std::pair(edge, 0)); }

private:
  std::vector<std::pair<Key, int>> of_;
};

class Packer {
public:
  Packer(const Mesh& mesh, const Eigen::AlignedBox3d& box)
      : mesh_(mesh), edges_(mesh), number_(mesh.vertices.size(), -1), done_(mesh.triangles.size(), false) {
    const Eigen::Vector3d size = box.sizes();
    for (const Eigen::Vector3d& v : mesh.vertices) {
      Place& place = places_.emplace_back(Place::Zero());
      for (int k = 0; k < 3; ++k)
        if (size[k] > 0) place[k] = std::llround((v[k] - box.min()[k]) / size[k] * kSteps);
    }
  }

  std::string pack() {
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
      if (done_[t]) continue;
      begin_with(t);
      while (!stack_.empty()) cross();
    }
    const std::string body = std::move(out_);
    out_.clear();
    put(mesh_.triangles.size());
    put(static_cast<std::uint64_t>(count_));
    return out_ + body;
  }

private:
  struct Gate {
    int a, b, c;  // edge a -> b of a triangle a, b, c
  };

  void put(std::uint64_t n) {
    for (; n > 127; n >>= 7) out_ += static_cast<char>(0x80 | (n & 127));
    out_ += static_cast<char>(n);
  }
  void put_signed(std::int64_t n) { put(n < 0 ? 2 * static_cast<std::uint64_t>(-(n + 1)) + 1 : 2 * static_cast<std::uint64_t>(n)); }

  void put_vertex(int v, const Place& expected) {
    put(0);
    const Place more = places_[static_cast<std::size_t>(v)] - expected;
    for (int k = 0; k < 3; ++k) put_signed(more[k]);
    number_[static_cast<std::size_t>(v)] = count_++;
    last_new_ = places_[static_cast<std::size_t>(v)];
  }

  void begin_with(std::size_t t) {
    done_[t] = true;
    const Eigen::Vector3i& corners = mesh_.triangles[t];
    for (int k = 0; k < 3; ++k) {
      const int known = number_[static_cast<std::size_t>(corners[k])];
      if (known >= 0)
        put(1 + static_cast<std::uint64_t>(known));
      else
        put_vertex(corners[k], last_new_);
    }
    const auto [a, b, c] = std::tuple(corners[0], corners[1], corners[2]);
    stack_.push_back({c, a, b});
    stack_.push_back({b, c, a});
    stack_.push_back({a, b, c});
  }

  /// Goes to the triangle at the other side of the last edge.
  void cross() {
    const auto [a, b, c] = stack_.back();
    stack_.pop_back();
    int next = -1;
    for (auto edge = edges_.first(key(b, a)); edge != edges_.end() && edge->first == key(b, a); ++edge) {
      if (done_[static_cast<std::size_t>(edge->second)]) return;
      if (next < 0) next = edge->second;
    }
    if (next < 0) {
      put(1);
      return;
    }
    done_[static_cast<std::size_t>(next)] = true;
    const Eigen::Vector3i& corners = mesh_.triangles[static_cast<std::size_t>(next)];
    int k = 0;
    while (corners[k] != b || corners[(k + 1) % 3] != a) ++k;
    const int d = corners[(k + 2) % 3];
    if (const int known = number_[static_cast<std::size_t>(d)]; known >= 0) {
      const std::int64_t ahead = known - last_named_;
      put(2 + (ahead < 0 ? 2 * static_cast<std::uint64_t>(-(ahead + 1)) + 1 : 2 * static_cast<std::uint64_t>(ahead)));
      last_named_ = known;
    } else {
      const auto at = [this](int v) { return places_[static_cast<std::size_t>(v)]; };
      put_vertex(d, at(a) + at(b) - at(c));
    }
    stack_.push_back({d, b, a});
    stack_.push_back({a, d, b});
  }

  const Mesh& mesh_;
  Edges edges_;
  std::vector<Place> places_;
  std::vector<int> number_;  // of each vertex as written; -1: not yet
  std::vector<bool> done_;
  std::vector<Gate> stack_;
  std::string out_;
  int count_ = 0;
  int last_named_ = 0;
  Place last_new_ = Place::Zero();
};

Mesh clustered(const Mesh& mesh, double cell_mm) {
  const Eigen::Vector3d low = bounding_box(mesh).min();
  std::map<std::array<std::int64_t, 3>, int> cells;
  std::vector<int> of_vertex;
  std::vector<double> members;
  Mesh result;
  for (const Eigen::Vector3d& v : mesh.vertices) {
    std::array<std::int64_t, 3> cell{};
    for (int k = 0; k < 3; ++k)
      cell[static_cast<std::size_t>(k)] = static_cast<std::int64_t>(std::floor((v[k] - low[k]) / cell_mm));
    const auto [found, is_new] = cells.emplace(cell, static_cast<int>(result.vertices.size()));
    if (is_new) {
      result.vertices.emplace_back(Eigen::Vector3d::Zero());
      members.push_back(0);
    }
    of_vertex.push_back(found->second);
    result.vertices[static_cast<std::size_t>(found->second)] += v;
    members[static_cast<std::size_t>(found->second)] += 1;
  }
  for (std::size_t n = 0; n < members.size(); ++n) result.vertices[n] /= members[n];
  for (const Eigen::Vector3i& t : mesh.triangles) {
    const Eigen::Vector3i corners = t.unaryExpr([&](int v) { return of_vertex[static_cast<std::size_t>(v)]; });
    if (corners[0] != corners[1] && corners[1] != corners[2] && corners[2] != corners[0]) result.triangles.push_back(corners);
  }
  return result;
}

}  // namespace

double rounding_mm(const Eigen::AlignedBox3d& box) { return box.isEmpty() ? 0 : box.sizes().maxCoeff() / (2 * kSteps); }

std::string packed(const Mesh& mesh, const Eigen::AlignedBox3d& box) { return Packer(mesh, box).pack(); }

std::string base64(const std::string& bytes) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t n = 0; n < bytes.size(); n += 3) {
    std::uint32_t word = 0;
    for (std::size_t k = 0; k < 3; ++k) word = (word << 8) | (n + k < bytes.size() ? static_cast<unsigned char>(bytes[n + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k) text += n + k > bytes.size() ? '=' : kDigits[(word >> (18 - 6 * k)) & 63];
  }
  return text;
}

bool is_closed(const Mesh& mesh) {
  bool closed = true;
  for_each_edge(mesh, [&closed](auto begin, auto end) { closed = closed && edge_balance(begin, end) == 0; });
  return closed;
}

Mesh coarsened(const Mesh& mesh, std::size_t most_triangles) {
  if (mesh.triangles.size() <= most_triangles) return mesh;
  // A flat surface has two triangles a cell.
  double cell_mm = std::sqrt(2 * surface_area(mesh) / static_cast<double>(most_triangles + 1));
  if (!(cell_mm > 0)) return {};
  Mesh result = clustered(mesh, cell_mm);
  while (result.triangles.size() > most_triangles) result = clustered(mesh, cell_mm *= 1.2);
  return result;
}

}  // namespace rayrep::report_detail
