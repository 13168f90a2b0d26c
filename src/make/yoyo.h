#pragma once

#include <memory>

#include "make/maker.h"
#include "rayrep/base/progress.h"
#include "rayrep/physics/spec.h"

namespace rayrep::detail {

/// What is left of a body when the gap for the string and the holes for the axle are taken from it: the outside of two halves.
/// @param spec  of a yo-yo with an axle, its centre filled in
/// @throws Error{goal} where the axle has no room, or more than two pieces would be left
Mesh outside_of_halves(const Mesh& outer, const SpinSpec& spec, const Progress& progress);

/// Moments of its steel, each times its density over that of the print, in the frame of the body.
Moments axle_moments(const SpinSpec& spec);

/// Two halves, each lying on its side of the gap, and the steel: what `maker` makes of such an outside.
std::unique_ptr<Maker> yoyo_maker(std::unique_ptr<Maker> maker, const SpinSpec& spec);

}  // namespace rayrep::detail
