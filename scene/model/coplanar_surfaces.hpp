// Finds surfaces of different objects that lie in one plane, face the same side and overlap.
// Rounding would decide pixel by pixel which of them a picture shows; ranks decide instead.
#pragma once

#include <cstddef>
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
  bool isComplete = true;           ///< false: too many triangles, or too many in one plane

  std::size_t countDifferentLooks() const;
};

/// Comparing them takes some seconds and at most 1.7 GB.
inline constexpr std::size_t kMaxCoplanarTriangles = 25'000'000;

/// Compares drawn opaque triangles of 0.01 m^2 or more. Objects whose triangles would exceed
/// `maxTriangles`, repetitions counted, are left out.
CoplanarSurfaces findCoplanarSurfaces(const Model& model,
                                      std::size_t maxTriangles = kMaxCoplanarTriangles);

/// Decides which of coplanar surfaces is visible.
struct CoplanarRank {
  std::uint8_t rank = 0;  ///< the lowest is visible
  /// World boxes of the objects of lower rank that it shares planes with, inflated by a millimetre.
  /// A box is endless if one of both is of a body, which may move.
  std::vector<Aabb> lower;
};

/// One an object. Of coplanar surfaces that of the object with the smaller box has the lower rank,
/// because details lie on large surfaces. In models of more than two million triangles all ranks
/// are 0. The search would delay the first picture, or the first ray, by seconds.
std::vector<CoplanarRank> rankCoplanarObjects(const Model& model);

}  // namespace enfilade::scene
