// Adds a town house, one of the prototypes that a district repeats.
#pragma once

#include "assets/random.hpp"
#include "assets/sketch.hpp"

namespace enfilade::assets {

/// The house is centred on the origin with its door towards +Z, on ground at y = 0; paths are
/// relative.
void addHouse(Sketch& sketch, Random& random);

/// Width of the widest house along X, metres.
inline constexpr double kHouseWidth = 12;

}  // namespace enfilade::assets
