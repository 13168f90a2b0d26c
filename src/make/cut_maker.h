#pragma once

#include <memory>

#include "make/body.h"
#include "make/maker.h"

namespace rayrep::detail {

/// What `maker` makes, cut into pieces that lie on their cuts, with holes for pins in both sides of each where there is room.
/// Planes that are not given are chosen by the first that is made; theory.md (105)-(107). Keeps references to body and print, and
/// writes the planes into `print`.
std::unique_ptr<Maker> cut_maker(std::unique_ptr<Maker> maker, const Body& body, Print& print, const Progress& progress);

}  // namespace rayrep::detail
