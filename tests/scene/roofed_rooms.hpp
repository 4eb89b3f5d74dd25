// Test scene: two rooms below a flat roof, with a gap between them.
#pragma once

#include <vector>

#include "tests/scene/box_scene.hpp"

namespace enfilade::scene::testing {

/// Rooms on 10 x 6 m. A wall at `x` has a gap around z = 0.
inline std::vector<NamedBox> makeRoofedRooms(double gap, double x = 5) {
  return {{"floor", {0, -0.2, -3}, {10, 0, 3}},
          {"wall/west", {0, 0, -3}, {0.2, 3, 3}},
          {"wall/east", {9.8, 0, -3}, {10, 3, 3}},
          {"wall/north", {0, 0, -3}, {10, 3, -2.8}},
          {"wall/south", {0, 0, 2.8}, {10, 3, 3}},
          {"wall/left", {x - 0.1, 0, -3}, {x + 0.1, 3, -0.5 * gap}},
          {"wall/right", {x - 0.1, 0, 0.5 * gap}, {x + 0.1, 3, 3}},
          {"roof", {0, 3, -3}, {10, 3.2, 3}}};
}

}  // namespace enfilade::scene::testing
