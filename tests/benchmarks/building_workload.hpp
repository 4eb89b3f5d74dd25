// The broad-phase workload: a building of storeys and rooms with avatars and rotating bodies.
// Each room of 6 m x 5 m has 68 static objects in shuffled order. 80 % of the dynamic boxes are
// avatars at 1.5 m/s; the others rotate and drift. 60 ticks a second. Equal seeds give equal
// numbers.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "tests/benchmarks/random.hpp"

namespace enfilade::benchmarks {

using collision::Aabb;

struct Building {
  std::vector<Aabb> staticBoxes;
  Vec3 extent = Vec3::Zero();  ///< metres; the low corner is the origin
};

/// Makes whole rooms with at least `objects` static boxes.
Building makeBuilding(std::size_t objects);

struct Body {
  Vec3 centre, velocity;  ///< metres; metres a tick
  Vec3 half, phase;       ///< metres; radians
  bool turns;
};

std::vector<Body> makeBodies(Random& random, std::size_t count, const Building& building);

/// Advances a body by one tick inside the building's walls, and returns its box.
Aabb step(Body& body, const Vec3& extent);

/// Generates all dynamic boxes, tick by tick.
class BuildingMotion {
 public:
  BuildingMotion(const Building& building, std::size_t dynamicBoxes);
  /// Advances by one tick.
  std::span<const Aabb> next();

 private:
  Vec3 extent_;
  std::vector<Body> bodies_;
  std::vector<Aabb> boxes_;
};

}  // namespace enfilade::benchmarks
