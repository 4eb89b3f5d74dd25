// A town house: one of the buildings that a district repeats.
#pragma once

#include "assets/random.hpp"
#include "assets/sketch.hpp"

namespace enfilade::assets {

/// Stands round the origin with its door towards +Z, on ground at y = 0; paths are relative.
void addHouse(Sketch& sketch, Random& random);

/// Widest house along X, metres.
inline constexpr double kHouseWidth = 12;

}  // namespace enfilade::assets
