#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "rayrep/draw/drawing.h"
#include "rayrep/draw/marks.h"
#include "rayrep/mesh/delivery.h"
#include "rayrep/mesh/section.h"

namespace rayrep {

/// The points p with normal . p = offset, in the frame of the mesh.
struct SectionPlane {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitY();  ///< unit vector
  std::optional<double> offset_mm = {};               ///< none: through the centre of mass
  std::string axis = "y";                             ///< of the normal, as it was given: "x", "1,0,1"

  std::string words(double offset) const;  ///< "y = 12.5 mm"
  std::string file_word() const;           ///< "y", "y0", "x-12.5", "1_0_1_30"
};

/// "y=0", "x", "1,0,1=30": a direction, and an offset along the unit vector of it. @throws Error{usage}
SectionPlane parse_section_plane(const std::string& text);

/// @throws Error{usage} where the plane, whose offset is given, does not meet the mesh, with where it would
void require_plane_meets(const SectionPlane& plane, const Mesh& mesh);

/// How a plane is looked at: rows of `to_view` are what points right, up and to the viewer. Up is up as far as it lies in the
/// plane, and what points right has its largest component positive; a plane across up is seen from above.
struct SectionView {
  Eigen::Matrix3d to_view = Eigen::Matrix3d::Identity();
  double depth_mm = 0;  ///< of the plane, towards the viewer
  bool level = false;   ///< the plane lies across up

  Eigen::Vector2d seen(const Eigen::Vector3d& p) const { return (to_view * p).head<2>(); }
};
SectionView view_of(const SectionPlane& plane, double offset_mm, const Eigen::Vector3d& up);

/// One kind of what is cut, as loops in the view.
struct SectionArea {
  enum class Kind { material, infill, insert };
  Kind kind = Kind::material;
  std::vector<SectionLoop> loops;
  double area_mm2() const;  ///< of its loops, holes less
};

/// The section of each part of a delivery: of the body in one, of modifiers and of what is put in.
std::vector<SectionArea> section_areas(const Delivery& delivery, const SectionView& view);

/// What is drawn of a body.
struct Subject {
  const Delivery& delivery;
  Marks marks;
  std::string name;       ///< for the title
  bool is_print = false;  ///< the body is the bars of what a nozzle laid down
};

/// The section drawn to scale, in axes of mm, over a pale picture of what lies behind it, with the marks, a scale bar and a legend.
/// Paths have the ids "material", "infill" and
/// "insert". @throws Error{usage} where the plane does not meet the body
Drawing section_drawing(const Subject& subject, const SectionPlane& plane);

}  // namespace rayrep
