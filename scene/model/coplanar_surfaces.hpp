// Finds surfaces of different objects that lie in one plane, face the same side and overlap.
// Rounding would decide pixel by pixel which of them a picture shows; ranks decide instead.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "scene/model/model.hpp"

namespace enfilade::scene {

/// Two objects, by index.
struct CoplanarPair {
  std::uint32_t first = 0, second = 0;  ///< first < second
  bool looksEqual = true;               ///< no overlapping triangles have different materials

  auto operator<=>(const CoplanarPair&) const = default;
};

struct CoplanarSurfaces {
  std::vector<CoplanarPair> pairs;  ///< ascending; some are missing if `isComplete` is false
  std::string example;              ///< the paths of the pair of different looks that overlaps most
  bool isComplete = true;           ///< false: the scene has too many surfaces in one plane

  std::size_t countDifferentLooks() const;
};

/// Compares drawn opaque triangles of 0.01 m^2 or more.
CoplanarSurfaces findCoplanarSurfaces(const Model& model);

/// One rank an object. Of coplanar surfaces the one of the lowest rank is visible: that of the
/// object with the smaller box, because details lie on large surfaces. Models of more than two
/// million triangles get ranks of 0, since the search would delay their first picture by seconds.
std::vector<std::uint8_t> rankCoplanarObjects(const Model& model);

}  // namespace enfilade::scene
