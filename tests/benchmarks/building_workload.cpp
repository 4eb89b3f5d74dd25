#include "tests/benchmarks/building_workload.hpp"

#include <algorithm>
#include <cmath>

namespace enfilade::benchmarks {
namespace {

constexpr int kObjectsPerRoom = 68;
constexpr double kRoomX = 6, kRoomZ = 5, kStorey = 3;
constexpr double kSecondsPerTick = 1.0 / 60;

Aabb makeBox(double x, double y, double z, double sx, double sy, double sz) {
  return {Vec3(x, y, z), Vec3(x + sx, y + sy, z + sz)};
}

void furnishRoom(Random& random, const Vec3& at, std::vector<Aabb>& staticBoxes) {
  staticBoxes.push_back(makeBox(at.x(), at.y() - 0.2, at.z(), kRoomX, 0.2, kRoomZ));
  staticBoxes.push_back(makeBox(at.x(), at.y(), at.z(), kRoomX, kStorey - 0.2, 0.15));
  staticBoxes.push_back(makeBox(at.x(), at.y(), at.z(), 0.15, kStorey - 0.2, 2));
  staticBoxes.push_back(makeBox(at.x(), at.y(), at.z() + 3, 0.15, kStorey - 0.2, 2));
  for (int k = 4; k < kObjectsPerRoom; ++k) {
    const bool large = k % 8 == 0;
    const double sx = drawUniform(random, 0.05, large ? 2.0 : 0.5);
    const double sy = drawUniform(random, 0.05, large ? 1.8 : 0.5);
    const double sz = drawUniform(random, 0.05, large ? 1.0 : 0.5);
    const double x = drawUniform(random, 0.2, kRoomX - sx);
    const double y = drawUniform(random, 0, k % 3 == 0 ? 2.0 : 0.9);
    const double z = drawUniform(random, 0.2, kRoomZ - sz);
    staticBoxes.push_back(makeBox(at.x() + x, at.y() + y, at.z() + z, sx, sy, sz));
  }
}

}  // namespace

Building makeBuilding(std::size_t objects) {
  Random random(1);
  const double rooms = std::ceil(static_cast<double>(objects) / kObjectsPerRoom);
  const int storeys = std::max(1, static_cast<int>(std::cbrt(rooms) / 2));
  const int along = std::max(1, static_cast<int>(std::ceil(std::sqrt(rooms / storeys))));
  Building building;
  for (int s = 0; s < storeys; ++s) {
    for (int x = 0; x < along; ++x) {
      for (int z = 0; z < along; ++z) {
        furnishRoom(random, Vec3(x * kRoomX, s * kStorey, z * kRoomZ), building.staticBoxes);
      }
    }
  }
  std::shuffle(building.staticBoxes.begin(), building.staticBoxes.end(), random);
  building.extent = Vec3(along * kRoomX, storeys * kStorey, along * kRoomZ);
  return building;
}

std::vector<Body> makeBodies(Random& random, std::size_t count, const Building& building) {
  std::vector<Body> bodies;
  for (std::size_t k = 0; k < count; ++k) {
    const bool turns = k % 5 == 4;
    const double heading = drawUniform(random, 0, 6.28);
    const double speed = turns ? 0.3 : 1.5;
    const double storey =
        std::floor(drawUniform(random, 0, building.extent.y() / kStorey)) * kStorey;
    const double x = drawUniform(random, 0, building.extent.x());
    const double z = drawUniform(random, 0, building.extent.z());
    const double phase = drawUniform(random, 0, 6.28);
    bodies.push_back({Vec3(x, storey + 0.9, z),
                      Vec3(std::cos(heading), 0, std::sin(heading)) * speed * kSecondsPerTick,
                      Vec3(0.3, 0.875, 0.3), Vec3(phase, phase / 2, phase / 3), turns});
  }
  return bodies;
}

Aabb step(Body& body, const Vec3& extent) {
  for (const int axis : {0, 2}) {
    if (body.centre[axis] < 0) body.velocity[axis] = std::abs(body.velocity[axis]);
    if (body.centre[axis] > extent[axis]) body.velocity[axis] = -std::abs(body.velocity[axis]);
  }
  body.centre += body.velocity;
  if (!body.turns) return {body.centre - body.half, body.centre + body.half};
  body.phase += Vec3(0.02, 0.015, 0.025);
  const Vec3 half = (0.3 + 0.3 * body.phase.array().sin().abs()).matrix();
  return {body.centre - half, body.centre + half};
}

BuildingMotion::BuildingMotion(const Building& building, std::size_t dynamicBoxes)
    : extent_(building.extent), boxes_(dynamicBoxes) {
  Random random(2);
  bodies_ = makeBodies(random, dynamicBoxes, building);
}

std::span<const Aabb> BuildingMotion::next() {
  for (std::size_t k = 0; k < bodies_.size(); ++k) boxes_[k] = step(bodies_[k], extent_);
  return boxes_;
}

}  // namespace enfilade::benchmarks
