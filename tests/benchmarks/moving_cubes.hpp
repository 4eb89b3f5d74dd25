// Workloads in which everything moves. MovingCubes: equal cubes of edge 1 m in frames of 1/30 s
// that pass through each other. Equal seeds give equal numbers.
//
// - brownian: a tenth of the volume is filled; each cube makes a random step of up to 0.2 m a
// frame.
// - falling: the cubes fall from a tower onto a floor, and bounce there ever lower.
// - turbulent: a dense heap in which each cube overlaps some nine others swirls about its centre.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "tests/benchmarks/random.hpp"

namespace enfilade::benchmarks {

using collision::Aabb;

enum class CubeMotion { brownian, falling, turbulent };
constexpr CubeMotion kCubeMotions[] = {CubeMotion::brownian, CubeMotion::falling,
                                       CubeMotion::turbulent};
const char* getName(CubeMotion motion);

class MovingCubes {
 public:
  MovingCubes(CubeMotion motion, std::size_t count);
  /// Advances by one frame.
  std::span<const Aabb> next();

 private:
  void moveRandomly();
  void fall();
  void swirl();

  CubeMotion motion_;
  Random random_{4};
  double width_;  ///< metres: edge of the room, or radius of the heap
  std::vector<Vec3> centres_, velocities_;
  std::vector<Aabb> boxes_;
};

/// People on the floor of a large hall, 4 m apart on average. They walk straight at up to 1.4 m/s
/// and turn back at the walls. `corner`: of the hall, metres.
class WalkingBoxes {
 public:
  WalkingBoxes(std::size_t count, const Vec3& corner);
  /// Advances by one frame.
  std::span<const Aabb> next();

 private:
  Random random_{5};
  Vec3 corner_;
  double width_;  ///< metres, of the hall
  std::vector<Vec3> feet_, velocities_;
  std::vector<Aabb> boxes_;
};

}  // namespace enfilade::benchmarks
