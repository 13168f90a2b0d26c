#include "mesh/quadric_refiner.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "mesh/box_tree.h"
#include "mesh/crossing.h"
#include "mesh/mesh_edges.h"

namespace rayrep {

using Eigen::Vector3d;
using Eigen::Vector3i;

namespace {

bool meets_any(const BoxTree& tree, const Eigen::AlignedBox3d& box, int number = 0) {
  const BoxTree::Node& node = tree.node(number);
  if (!box.intersects(node.box)) return false;
  if (!node.is_leaf()) return meets_any(tree, box, number + 1) || meets_any(tree, box, node.right);
  for (std::size_t n = node.begin; n < node.end; ++n)
    if (box.intersects(tree.box_of(tree.member(n)))) return true;
  return false;
}

}  // namespace

QuadricAlong::QuadricAlong(const Quadric& f, const Vector3d& a, const Vector3d& b, double fa, double fb)
    : at_a(fa), slope(0), bend(0.5 * (b - a).dot(f.hessian * (b - a))) {
  slope = fb - fa - bend;
}

double QuadricAlong::root() const {
  const double root = std::sqrt(std::max(0.0, slope * slope - 4 * bend * at_a));
  const double q = -0.5 * (slope + std::copysign(root, slope != 0 ? slope : bend));  // the other way for -f
  const double one = q == 0 ? 0.5 : at_a / q;
  const double two = bend == 0 ? one : q / bend;
  const auto outside = [](double t) { return std::max({0.0, -t, t - 1}); };
  return std::clamp(outside(one) <= outside(two) ? one : two, 0.0, 1.0);
}

QuadricRefiner::QuadricRefiner(Mesh& mesh, const Quadric& f, const QuadricClipOptions& options)
    : mesh_(mesh),
      f_(f),
      options_(options),
      land_(f, options),
      is_new_(mesh.vertices.size(), 0),
      is_moved_(mesh.vertices.size(), 0) {
  for (const Vector3d& v : mesh.vertices) value_.push_back(f.value(v));
}

Vector3d QuadricRefiner::area(const Vector3i& v) const {
  const Vector3d& a = mesh_.vertices[v[0]];
  return (mesh_.vertices[v[1]] - a).cross(mesh_.vertices[v[2]] - a);
}

int QuadricRefiner::add(const Vector3d& p) {
  mesh_.vertices.push_back(p);
  value_.push_back(f_.value(p));
  is_new_.push_back(1);
  is_moved_.push_back(0);
  return static_cast<int>(mesh_.vertices.size()) - 1;
}

void QuadricRefiner::move(int n, const Vector3d& p) {
  mesh_.vertices[n] = p;
  value_[n] = f_.value(p);
  is_new_[n] = 1;
}

bool QuadricRefiner::land(const std::vector<std::size_t>& triangles) {
  if (!options_.surface) return false;
  std::unordered_map<int, Vector3d> before;
  for (const std::size_t t : triangles)
    for (const int n : mesh_.triangles[t]) {
      if (stays_.contains(n)) continue;
      const std::optional<Vector3d> p = land_.on_surface(mesh_.vertices[n], 8 * options_.error_mm);
      if (!p || options_.is_above(f_.value(*p)) == above(n)) continue;
      before.emplace(n, mesh_.vertices[n]);
      move(n, *p);
    }
  bool any = !before.empty();
  while (any && undo_crossings(before)) any = !before.empty();
  for (const auto& [n, p] : before) is_moved_[n] = 1;
  return any;
}

/// Vertices that were moved, to where something crosses, go back. @returns whether any did
bool QuadricRefiner::undo_crossings(std::unordered_map<int, Vector3d>& before) {
  std::vector<char> moved(mesh_.vertices.size(), 0);
  for (const auto& [n, p] : before) moved[n] = 1;
  bool any = false;
  for (const std::size_t t : crossing_near(mesh_, moved))
    for (const int n : mesh_.triangles[t]) {
      const auto place = before.find(n);
      if (place == before.end()) continue;
      move(n, place->second);
      stays_.insert(n);
      before.erase(place);
      any = true;
    }
  return any;
}

void QuadricRefiner::run() {
  new_.resize(mesh_.triangles.size());
  std::iota(new_.begin(), new_.end(), std::size_t{0});
  refine();
}

void QuadricRefiner::refine() {
  constexpr int kRounds = 60;  // two halve a triangle's size
  for (int round = 0; round < kRounds; ++round) {
    begin();
    for (const std::size_t t : new_) look_at(t);
    if (middle_.empty() && inner_.empty()) return;
    new_.clear();
    split_all();
  }
}

void QuadricRefiner::begin() {
  middle_.clear();
  inner_.clear();
}

bool QuadricRefiner::split(const std::vector<std::size_t>& triangles) {
  begin();
  new_.clear();
  for (const std::size_t t : triangles) {
    const Vector3i& v = mesh_.triangles[t];
    bool has_ridge = false;
    int longest = -1;
    for (int k = 0; k < 3; ++k) {
      const int a = v[k];
      const int b = v[(k + 1) % 3];
      if (!may_halve(a, b)) continue;
      has_ridge = split_at_ridge(a, b) || has_ridge;
      if (longest < 0 || length(a, b) > length(v[longest], v[(longest + 1) % 3])) longest = k;
    }
    if (has_ridge || longest < 0) continue;
    const int a = v[longest];
    const int b = v[(longest + 1) % 3];
    const std::uint64_t key = edge_key(a, b);
    if (middle_.contains(key)) continue;
    const Vector3d on_edge = middle(a, b);
    if (const std::optional<Vector3d> p = land_.on_surface(on_edge, 0.5 * length(a, b)))
      middle_.emplace(key, Middle{add(*p), on_edge, false});
    else
      whole_.insert(key);
  }
  if (middle_.empty()) return false;
  split_all();
  if (new_.empty()) return false;
  refine();
  return true;
}

bool QuadricRefiner::may_halve(int a, int b) const {
  return length(a, b) >= 4 * options_.error_mm && !whole_.contains(edge_key(a, b));
}

bool QuadricRefiner::split_at_ridge(int a, int b) {
  const std::uint64_t key = edge_key(a, b);
  if (middle_.contains(key)) return true;
  const std::optional<Vector3d> ridge = land_.on_ridge(mesh_.vertices[a], mesh_.vertices[b]);
  if (ridge) middle_.emplace(key, Middle{add(*ridge), middle(a, b), false});
  return ridge.has_value();
}

void QuadricRefiner::look_at(std::size_t t) {
  const Vector3i v = mesh_.triangles[t];
  const int count = above(v[0]) + above(v[1]) + above(v[2]);
  bool is_split = false;
  for (int k = 0; k < 3; ++k)
    if (above(v[k]) == above(v[(k + 1) % 3])) is_split = split_twice_crossed(v[k], v[(k + 1) % 3]) || is_split;
  if (is_split) return;
  if (count == 0 || count == 3)
    split_around_extreme(t);
  else
    split_long_chord(v);
}

/// Where f changes its sign and back along an edge, by more than the error.
bool QuadricRefiner::split_twice_crossed(int a, int b) {
  const QuadricAlong along(f_, mesh_.vertices[a], mesh_.vertices[b], value_[a], value_[b]);
  if (along.bend == 0 || (along.bend > 0) != above(a) ||
      std::min(std::abs(value_[a]), std::abs(value_[b])) >= 0.25 * std::abs(along.bend))
    return false;
  const double t = -0.5 * along.slope / along.bend;
  if (!(t > 0 && t < 1) || (along.at_a + 0.5 * t * along.slope > 0) == above(a)) return false;
  const Vector3d p = mesh_.vertices[a] + t * (mesh_.vertices[b] - mesh_.vertices[a]);
  if (!(std::abs(f_.distance(p)) > options_.error_mm)) return false;
  split_needed(a, b, p);
  return true;
}

/// Where f has another sign within a triangle than all around it.
void QuadricRefiner::split_around_extreme(std::size_t t) {
  const Vector3d& a = mesh_.corner(t, 0);
  Eigen::Matrix<double, 3, 2> sides;
  sides << mesh_.corner(t, 1) - a, mesh_.corner(t, 2) - a;
  const Eigen::Matrix2d bend = sides.transpose() * f_.hessian * sides;
  const double sign = above(mesh_.triangles[t][0]) ? 1 : -1;
  const double determinant = bend.determinant();
  if (!(determinant > 0) || sign * bend(0, 0) <= 0) return;
  const Eigen::Vector2d s = -bend.inverse() * (sides.transpose() * f_.gradient(a));
  if (!(s.minCoeff() > 0 && s.sum() < 1)) return;
  const Vector3d p = a + sides * s;
  if (sign * f_.value(p) < 0 && std::abs(f_.distance(p)) > options_.error_mm) inner_.emplace_back(t, p);
}

/// Where the curve leaves its chord in a triangle, that is halved.
void QuadricRefiner::split_long_chord(const Vector3i& v) {
  Vector3d ends[2];
  int n = 0;
  int longest = 0;
  for (int k = 0; k < 3; ++k) {
    const Vector3d& a = mesh_.vertices[v[k]];
    const Vector3d& b = mesh_.vertices[v[(k + 1) % 3]];
    if (above(v[k]) != above(v[(k + 1) % 3]) && n < 2)
      ends[n++] = a + QuadricAlong(f_, a, b, value_[v[k]], value_[v[(k + 1) % 3]]).root() * (b - a);
    if ((b - a).norm() > length(v[longest], v[(longest + 1) % 3])) longest = k;
  }
  const double chord = (ends[1] - ends[0]).norm();
  const double sag = std::abs(f_.distance(0.5 * (ends[0] + ends[1])));
  if (chord < 4 * options_.error_mm || !(sag > options_.error_mm)) return;
  const int a = v[longest];
  const int b = v[(longest + 1) % 3];
  split_needed(a, b, middle(a, b));
}

void QuadricRefiner::split_needed(int a, int b, const Vector3d& p) {
  const std::uint64_t key = edge_key(a, b);
  if (!middle_.contains(key)) middle_.emplace(key, Middle{add(land_.on_surface(p, 4 * options_.error_mm).value_or(p)), p, true});
}

void QuadricRefiner::split_all() {
  split_inner();
  const std::vector<std::size_t> triangles = touched();
  std::vector<Cut> all = cuts(triangles);
  while (undo_folds(all) || undo_crossings(all)) all = cuts(triangles);
  for (const Cut& cut : all) replace(cut.triangle, pieces(cut));
}

void QuadricRefiner::split_inner() {
  for (const auto& [t, p] : inner_) {
    const Vector3i v = mesh_.triangles[t];
    bool is_cut = false;  // by a neighbour: it is looked at again
    for (int k = 0; k < 3; ++k) is_cut = is_cut || middle_.contains(edge_key(v[k], v[(k + 1) % 3]));
    if (is_cut) continue;
    const int n = add(land_.on_surface(p, 4 * options_.error_mm).value_or(p));
    const std::vector<Vector3i> pieces{{v[0], v[1], n}, {v[1], v[2], n}, {v[2], v[0], n}};
    if (is_folded(v, pieces)) move(n, p);
    replace(t, pieces);
  }
}

/// Triangles with a side that is to be split.
std::vector<std::size_t> QuadricRefiner::touched() const {
  std::vector<std::size_t> triangles;
  if (middle_.empty()) return triangles;
  std::vector<char> is_end(mesh_.vertices.size(), 0);
  for (const auto& [key, middle] : middle_) is_end[key >> 32] = is_end[key & 0xffffffff] = 1;
  for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
    const Vector3i& v = mesh_.triangles[t];
    if (is_end[v[0]] + is_end[v[1]] + is_end[v[2]] < 2) continue;
    if (middle_.contains(edge_key(v[0], v[1])) || middle_.contains(edge_key(v[1], v[2])) || middle_.contains(edge_key(v[2], v[0])))
      triangles.push_back(t);
  }
  return triangles;
}

std::vector<QuadricRefiner::Cut> QuadricRefiner::cuts(const std::vector<std::size_t>& triangles) const {
  std::vector<Cut> cuts;
  for (const std::size_t t : triangles) {
    const Vector3i& v = mesh_.triangles[t];
    Cut cut{t, {-1, -1, -1}};
    for (int k = 0; k < 3; ++k) {
      const auto found = middle_.find(edge_key(v[k], v[(k + 1) % 3]));
      if (found != middle_.end()) cut.middle[k] = found->second.vertex;
    }
    if (*std::max_element(cut.middle.begin(), cut.middle.end()) >= 0) cuts.push_back(cut);
  }
  return cuts;
}

/// What the way of new vertices onto the surface has turned over. @returns whether any of them went back
bool QuadricRefiner::undo_folds(const std::vector<Cut>& cuts) {
  bool changed = false;
  for (const Cut& cut : cuts)
    if (is_folded(mesh_.triangles[cut.triangle], pieces(cut))) changed = undo(cut) || changed;
  return changed;
}

/// What it has made cross others, or one another.
bool QuadricRefiner::undo_crossings(const std::vector<Cut>& cuts) {
  const auto is_far = [this](const auto& edge) {
    return (mesh_.vertices[edge.second.vertex] - edge.second.on_edge).norm() > 0.5 * options_.error_mm;
  };
  if (std::none_of(middle_.begin(), middle_.end(), is_far)) return false;
  Mesh local;
  std::unordered_map<int, int> number;
  std::vector<std::size_t> of;  // which cut each triangle comes from
  const auto add = [&](const Vector3i& v, std::size_t cut) {
    Vector3i own;
    for (int k = 0; k < 3; ++k) {
      const auto [place, is_new] = number.try_emplace(v[k], static_cast<int>(local.vertices.size()));
      if (is_new) local.vertices.push_back(mesh_.vertices[v[k]]);
      own[k] = place->second;
    }
    local.triangles.push_back(own);
    of.push_back(cut);
  };
  for (std::size_t n = 0; n < cuts.size(); ++n)
    for (const Vector3i& piece : pieces(cuts[n])) add(piece, n);
  for (const Vector3i& v : around(cuts)) add(v, cuts.size());
  bool changed = false;
  for (const auto& [s, t] : crossing_pairs(local, close_pairs(local)))
    for (const std::size_t n : {of[s], of[t]})
      if (n < cuts.size()) changed = undo(cuts[n]) || changed;
  return changed;
}

/// Puts the new vertices of a triangle onto its sides, or leaves these whole.
bool QuadricRefiner::undo(const Cut& cut) {
  bool changed = false;
  const Vector3i& v = mesh_.triangles[cut.triangle];
  for (int k = 0; k < 3; ++k) {
    const auto found = middle_.find(edge_key(v[k], v[(k + 1) % 3]));
    if (found == middle_.end()) continue;
    const Middle& middle = found->second;
    if (middle.is_needed) {
      changed = changed || mesh_.vertices[middle.vertex] != middle.on_edge;
      move(middle.vertex, middle.on_edge);
    } else {
      changed = true;
      whole_.insert(found->first);
      middle_.erase(found);
    }
  }
  return changed;
}

bool QuadricRefiner::is_folded(const Vector3i& v, const std::vector<Vector3i>& pieces) const {
  constexpr double kLeast = 0.2;  // cosine
  const Vector3d whole = area(v);
  return std::any_of(pieces.begin(), pieces.end(), [&](const Vector3i& piece) {
    const Vector3d part = area(piece);
    if (part.dot(whole) >= kLeast * part.norm() * whole.norm()) return false;
    return !land_.faces_outward((mesh_.vertices[piece[0]] + mesh_.vertices[piece[1]] + mesh_.vertices[piece[2]]) / 3, part);
  });
}

/// The other triangles at the corners of those that are cut, and in the way of new vertices that are far from their sides.
std::vector<Vector3i> QuadricRefiner::around(const std::vector<Cut>& cuts) const {
  std::vector<char> is_cut(mesh_.triangles.size(), 0);
  std::vector<char> near(mesh_.vertices.size(), 0);
  std::vector<Eigen::AlignedBox3d> far;
  for (const Cut& cut : cuts) {
    is_cut[cut.triangle] = 1;
    Eigen::AlignedBox3d box = box_of(mesh_.triangles[cut.triangle]);
    bool leaves = false;
    for (const int n : cut.middle) {
      if (n < 0) continue;
      leaves = leaves || box.exteriorDistance(mesh_.vertices[n]) > 0;
      box.extend(mesh_.vertices[n]);
    }
    if (leaves) far.push_back(box);
    for (const int n : mesh_.triangles[cut.triangle]) near[n] = 1;
  }
  const BoxTree ways(std::move(far));
  std::vector<Vector3i> triangles;
  for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
    const Vector3i& v = mesh_.triangles[t];
    if (!is_cut[t] && (near[v[0]] || near[v[1]] || near[v[2]] || meets_any(ways, box_of(v)))) triangles.push_back(v);
  }
  return triangles;
}

Eigen::AlignedBox3d QuadricRefiner::box_of(const Vector3i& v) const {
  Eigen::AlignedBox3d box;
  for (const int n : v) box.extend(mesh_.vertices[n]);
  return box;
}

/// What the split sides leave of a triangle.
std::vector<Vector3i> QuadricRefiner::pieces(const Cut& cut) const {
  const Vector3i& v = mesh_.triangles[cut.triangle];
  const std::array<int, 3>& middle = cut.middle;
  std::vector<int> ring;
  for (int k = 0; k < 3; ++k) {
    ring.push_back(v[k]);
    if (middle[k] >= 0) ring.push_back(middle[k]);
  }
  // A corner whose both sides are split is cut off; what remains has a corner that sees it all.
  std::vector<Vector3i> pieces;
  for (int k = 0; k < 3 && ring.size() > 4; ++k)
    if (middle[k] >= 0 && middle[(k + 2) % 3] >= 0) {
      pieces.emplace_back(middle[(k + 2) % 3], v[k], middle[k]);
      ring.erase(std::find(ring.begin(), ring.end(), v[k]));
    }
  if (ring.size() == 4) {
    const auto is_middle = [&middle](int n) { return std::find(middle.begin(), middle.end(), n) != middle.end(); };
    // With one side split its middle sees all, else the end of the shorter diagonal.
    const auto first = pieces.empty()                                         ? std::find_if(ring.begin(), ring.end(), is_middle)
                       : length(ring[0], ring[2]) <= length(ring[1], ring[3]) ? ring.begin()
                                                                              : ring.begin() + 1;
    std::rotate(ring.begin(), first, ring.end());
  }
  for (std::size_t k = 2; k < ring.size(); ++k) pieces.emplace_back(ring[0], ring[k - 1], ring[k]);
  return pieces;
}

void QuadricRefiner::replace(std::size_t t, const std::vector<Vector3i>& pieces) {
  mesh_.triangles[t] = pieces[0];
  new_.push_back(t);
  for (std::size_t n = 1; n < pieces.size(); ++n) {
    new_.push_back(mesh_.triangles.size());
    mesh_.triangles.push_back(pieces[n]);
  }
}

}  // namespace rayrep
