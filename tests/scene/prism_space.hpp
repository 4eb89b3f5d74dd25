// A space that is an upright prism, for tests.
#pragma once

#include <array>
#include <vector>

#include "scene/model/model.hpp"

namespace enfilade::tests {

/// The outline in x and z, whose first corner sees all others; metres, from height 0 up.
inline scene::Space makePrism(const std::vector<std::array<double, 2>>& outline, double height) {
  using scene::Vec3;
  scene::Space space;
  const std::size_t count = outline.size();
  const auto low = [&](std::size_t i) {
    return Vec3(outline[i % count][0], 0, outline[i % count][1]);
  };
  const auto high = [&](std::size_t i) -> Vec3 { return low(i) + Vec3(0, height, 0); };
  for (std::size_t i = 0; i < count; ++i) {
    space.box.include(low(i));
    space.box.include(high(i));
    space.surface.insert(space.surface.end(), {low(i), high(i), high(i + 1)});
    space.surface.insert(space.surface.end(), {low(i), high(i + 1), low(i + 1)});
    if (i == 0 || i + 1 == count) continue;
    space.surface.insert(space.surface.end(), {low(0), low(i), low(i + 1)});
    space.surface.insert(space.surface.end(), {high(0), high(i + 1), high(i)});
  }
  return space;
}

}  // namespace enfilade::tests
