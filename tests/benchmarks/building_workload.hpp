// The broad-phase workload: a building of storeys and rooms, walkers and turning bodies.
//
// 68 still objects a room of 6 m x 5 m, their order shuffled; 80 % of the movers are avatars at
// 1.5 m/s, the others turn and drift; 60 ticks a second. Seeded: the same numbers every time.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "tests/benchmarks/random.hpp"

namespace enfilade::benchmarks {

using collision::Box;

struct Building {
  std::vector<Box> still;
  Vec3 extent = Vec3::Zero();  ///< metres; the low corner is the origin
};

/// At least `objects` still boxes, a whole number of rooms.
Building makeBuilding(std::size_t objects);

struct Body {
  Vec3 centre, velocity;  ///< metres; metres a tick
  Vec3 half, phase;       ///< metres; radians
  bool turns;
};

std::vector<Body> makeBodies(Random& random, std::size_t count, const Building& building);

/// Moves a body on by one tick, inside the building's walls, and returns its box.
Box step(Body& body, const Vec3& extent);

/// The boxes of all movers, tick after tick.
class BuildingMotion {
 public:
  BuildingMotion(const Building& building, std::size_t movers);
  /// Goes on by one tick.
  std::span<const Box> next();

 private:
  Vec3 extent_;
  std::vector<Body> bodies_;
  std::vector<Box> boxes_;
};

}  // namespace enfilade::benchmarks
