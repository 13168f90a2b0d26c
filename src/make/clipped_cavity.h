#pragma once

#include <functional>
#include <optional>

#include "mesh/quadric_clip.h"
#include "rayrep/make/cavity.h"

namespace rayrep::detail {

/// How the surface at the wall's distance is made lighter.
struct Lighter {
  double chord_error_mm = 0;
  /// Which of its vertices are needed: only the triangles at these are mended.
  std::function<bool(const Eigen::Vector3d&)> needs = [](const Eigen::Vector3d&) { return true; };
};

/// The surface of all that is at least the wall away, closed and facing outward.
struct OffsetSurface {
  Mesh mesh;
  Mesh specks;  ///< shells too small for a cavity
};

/// With few triangles: none is farther from it than the error. Where it crosses itself it is closed in `field`, as far as that
/// helps, and counted in `result`.
OffsetSurface offset_surface(BlockField& field, const SurfaceQuery& surface, const CavityOptions& options, const Lighter& lighter,
                             CavityMesh& result);
/// Closes the cavity around a point: all samples within a step of it along each axis. @returns how many were inside
std::size_t close_around(BlockField& field, const Eigen::Vector3d& p);
/// Shells that are cavities go into `result`, facing inward; islands and what is too small are counted.
void take_shells(const Mesh& all, const CavityOptions& options, CavityMesh& result);

/// The surface at the wall's distance, meshed once, of which any quadric cuts the cavity: its creases are on the exact curve, and
/// what the quadric does not touch is the same for all. theory.md (88)
class ClippedCavity {
public:
  /// Keeps references to all but q. The options have no inset: what is so far from a quadric ends on a surface of the fourth degree
  /// (theory.md (48)). @param field  wall - distance; closed where its zero set, or what is cut of it, crosses itself
  /// @param q  near to what it is cut by: where it is cut away it is not mended before it is needed
  ClippedCavity(BlockField& field, const SurfaceQuery& surface, const CavityOptions& options, const Moments& q);

  /// The cavity { p : distance(p) >= wall, q.phi(p) > 0 }.
  /// @returns none where it cannot be cut: mesh_cavity is to mesh it
  std::optional<CavityMesh> cut(const Moments& q);
  /// The same with the triangles of the last cut, whose creases and caps follow the quadric: smooth in q.
  /// @returns none where they do not reach, or there are none
  std::optional<CavityMesh> follow(const Moments& q);

private:
  /// What followed and was mended, for where it cannot be cut anew or has to be mended as far then.
  struct Followed {
    Moments q;
    QuadricClipped cut;
    std::vector<Eigen::Vector3d> mending;
    double mended_mm;
    CavityMesh cavity;
  };

  /// What follows, before it is mended.
  struct Moved {
    QuadricClipped cut;
    Mesh mesh;             ///< with what was mended of the last one
    std::size_t crossing;  ///< triangles of the mesh, as delivered
  };

  std::optional<Moved> follow(const Quadric& f, bool carry) const;
  void mesh_offset(const Quadric& first);
  std::optional<CavityMesh> cut_anew(const Quadric& f);
  std::optional<CavityMesh> cut_as_it_is(const Quadric& f);
  bool close_where_it_crosses(const Quadric& f);
  bool mend_what_is_left(const Quadric& f);
  void note_crossing(const Mesh& mesh, const std::vector<std::size_t>& triangles);
  double far_mended_mm() const { return 0.2 * options_.least_distance_mm(); }
  QuadricClipOptions clip_options() const;
  std::optional<CavityMesh> mended(QuadricClipped cut, Mesh mesh, const Quadric& f);
  CavityMesh taken(Mesh all, const Quadric& f) const;

  BlockField& field_;
  const SurfaceQuery& surface_;
  const CavityOptions& options_;
  double reach_mm_;                        ///< of vertices from the surface's distance
  CavityMesh made_;                        ///< of all that is at least the wall away: only what it counts
  Mesh offset_;                            ///< facing outward
  std::vector<Mesh> specks_;               ///< what is left out of it: cavities that are filled where nothing cuts them away
  std::vector<char> mended_;               ///< of its vertices: all triangles at them are
  std::optional<QuadricClipped> last_;     ///< before it was mended
  std::vector<Eigen::Vector3d> mending_;   ///< by how much each of its vertices was moved then
  double farthest_mended_mm_ = 0;          ///< of creases
  std::vector<Eigen::Vector3d> crossing_;  ///< corners of what could not be mended
  int closings_ = 0;                       ///< so often
  bool was_cut_anew_ = false;              ///< for that
  std::optional<Followed> far_;            ///< mended so far that it is to be cut anew
};

}  // namespace rayrep::detail
