#pragma once

#include <optional>
#include <string>
#include <vector>

#include "rayrep/draw/drawing.h"
#include "rayrep/draw/section_picture.h"
#include "rayrep/mesh/delivery.h"
#include "rayrep/mesh/mesh.h"

namespace rayrep {

/// A body before and after.
struct BodyPicture {
  Subject after;
  const Mesh* before = nullptr;          ///< the solid; null: it is not shown
  const Mesh* deformed = nullptr;        ///< the outside as it was moved: the vertices of `before`, moved; null: it was not
  std::optional<SectionPlane> cut = {};  ///< none: plane_through_inside, where anything is inside
};

/// The plane that usually shows most: upright, through the centre of mass, along the longer side.
SectionPlane usual_plane(const Mesh& mesh, const Eigen::Vector3d& up);

/// The same with its offset, through `centre`; where it cuts no cavity, as in the gap of a yo-yo, the first that does of the other
/// upright one, the level one, and all three through the largest cavity.
SectionPlane plane_through_inside(const Mesh& mesh, const Eigen::Vector3d& up, const Eigen::Vector3d& centre);

/// Seen from above and the side, next to each other: before, or without it what is delivered as a whole if it is cut; where it was
/// deformed, the outside with how far it was moved in colour; and what is delivered, cut open, with what it is made of. All to one
/// scale.
Drawing body_drawing(const BodyPicture& what);

/// A PNG of what is delivered for viewers of files, cut open if there is anything inside; square, around it transparent.
std::string thumbnail_png(const Delivery& delivery, const Eigen::Vector3d& up, int pixels = 256);

}  // namespace rayrep
