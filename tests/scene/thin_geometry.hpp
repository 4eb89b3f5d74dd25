// Closed rooms of thin obstacles, and an exact check that no avatar crossed one. It uses the narrow
// phase on every triangle and part, and the side of each sheet.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "collision/narrow_phase/narrow_phase.hpp"
#include "scene/world/world.hpp"
#include "tests/scene/box_scene.hpp"

namespace enfilade::scene::testing {

class Seeded {
 public:
  explicit Seeded(std::uint64_t seed) : random_(seed) {}
  double drawUniform(double low, double high) {
    return low + (high - low) * (static_cast<double>(random_() >> 11) * 0x1p-53);
  }
  int drawBelow(int bound) {
    return static_cast<int>(random_() % static_cast<std::uint64_t>(bound));
  }

 private:
  std::mt19937_64 random_;
};

/// Builds a model of triangles and boxes.
struct Builder {
  Model model;

  Builder() {
    model.source = "thin geometry";
    model.materials.emplace_back();
  }
  void add(const std::string& path, Mesh mesh) {
    model.meshes.push_back(std::move(mesh));
    model.objects.push_back({path,
                             "",
                             {static_cast<std::uint32_t>(model.meshes.size() - 1)},
                             Eigen::Affine3d::Identity()});
  }
  void addBox(const std::string& path, const Vec3& min, const Vec3& max) {
    add(path, buildBoxMesh(min, max));
  }
  /// A sheet of zero thickness: four corners in order.
  void addSheet(const std::string& path, const std::vector<Vec3>& corners) {
    Mesh mesh;
    for (const Vec3& corner : corners) mesh.positions.push_back(corner.cast<float>());
    mesh.indices = {0, 1, 2, 0, 2, 3};
    add(path, std::move(mesh));
  }
  /// The same sheet as slivers from its first corner: all triangles are long and thin.
  void addSlivers(const std::string& path, const std::vector<Vec3>& corners, int count) {
    Mesh mesh;
    const auto along = [&](const Vec3& from, const Vec3& to, int i) {
      return Vec3(from + (to - from) * (double(i) / count));
    };
    mesh.positions.push_back(corners[0].cast<float>());
    for (int i = 0; i <= count; ++i)
      mesh.positions.push_back(along(corners[1], corners[2], i).cast<float>());
    for (int i = 1; i <= count; ++i)
      mesh.positions.push_back(along(corners[2], corners[3], i).cast<float>());
    for (std::uint32_t i = 1; i < mesh.positions.size() - 1; ++i)
      mesh.indices.insert(mesh.indices.end(), {0, i, i + 1});
    add(path, std::move(mesh));
  }
};

/// Side walls, roof and floor of one cell, of sheets: [x, x + size] x [z, z + size].
inline void addSheetCell(Builder& b, const std::string& name, const Vec3& min, const Vec3& max,
                         bool sliced) {
  const auto wall = [&](const std::string& side, const std::vector<Vec3>& corners) {
    if (sliced) {
      b.addSlivers(name + side, corners, 9);
    } else {
      b.addSheet(name + side, corners);
    }
  };
  const double x0 = min.x(), x1 = max.x(), y0 = min.y(), y1 = max.y(), z0 = min.z(), z1 = max.z();
  wall("/west", {{x0, y0, z0}, {x0, y0, z1}, {x0, y1, z1}, {x0, y1, z0}});
  wall("/east", {{x1, y0, z0}, {x1, y0, z1}, {x1, y1, z1}, {x1, y1, z0}});
  wall("/south", {{x0, y0, z0}, {x1, y0, z0}, {x1, y1, z0}, {x0, y1, z0}});
  wall("/north", {{x0, y0, z1}, {x1, y0, z1}, {x1, y1, z1}, {x0, y1, z1}});
  wall("/floor", {{x0, y0, z0}, {x1, y0, z0}, {x1, y0, z1}, {x0, y0, z1}});
  wall("/roof", {{x0, y1, z0}, {x1, y1, z0}, {x1, y1, z1}, {x0, y1, z1}});
}

/// The number of non-separated verdicts of every avatar part on each triangle and hull of the scene
/// and on the other avatars' parts. Uses none of the tick's caches.
inline int countPenetrations(const World& world) {
  const auto& avatars = world.snapshot()->avatars;
  std::vector<std::vector<collision::Triangle>> triangles;
  std::vector<std::pair<Aabb, collision::PlacedConvex>> still;
  for (const std::uint32_t object : world.scene().solidObjects()) {
    triangles.push_back(collectSolidTriangles(world.scene().model(), object));
    for (const collision::Triangle& t : triangles.back())
      still.push_back({collision::computeAabb(t), {std::span<const Vec3>(t), Vec3::Zero()}});
    const CollisionGeometry& parts = world.scene().collisionGeometry(object);
    for (std::uint32_t i = 0; i < parts.hullCount(); ++i)
      still.push_back({parts.box(i), parts.convex(i)});
  }
  int found = 0;
  const auto check = [&](const collision::PlacedConvex& a, const Aabb& boxA,
                         const collision::PlacedConvex& b, const Aabb& boxB) {
    if (!overlaps(boxA, boxB)) return;  // skips by boxes that are exact or larger
    collision::FeatureCache cache;
    found += collision::computeSeparation(a, b, cache).verdict != collision::Verdict::separated;
  };
  for (std::size_t i = 0; i < avatars.size(); ++i) {
    for (const AvatarPart& part : avatars[i].shape->parts) {
      const collision::PlacedConvex body = placeAvatarPart(part, avatars[i].footPosition);
      const Aabb box = inflate(placeBox(part.box, avatars[i].footPosition), 1e-9);
      for (const auto& [otherBox, other] : still) check(body, box, other, otherBox);
      for (std::size_t k = i + 1; k < avatars.size(); ++k)
        for (const AvatarPart& other : avatars[k].shape->parts)
          check(body, box, placeAvatarPart(other, avatars[k].footPosition),
                inflate(placeBox(other.box, avatars[k].footPosition), 1e-9));
    }
  }
  return found;
}

inline double drawSpeed(Seeded& random) {
  return 0.01 * std::pow(10.0, random.drawUniform(0, 5));
}

/// A velocity for an avatar, sometimes straight at a wall.
inline Vec3 drawVelocity(Seeded& random, bool flies) {
  const double angle = random.drawBelow(4) == 0 ? 0.5 * 3.14159265358979 * random.drawBelow(4)
                                                : random.drawUniform(0, 6.2832);
  const double speed = drawSpeed(random);
  const double up = flies ? random.drawUniform(-1, 1) : 0;
  return speed * Vec3(std::cos(angle), up, std::sin(angle)).normalized();
}

/// A closed cell that its avatar must not leave.
struct Cell {
  Vec3 min, max;
  std::optional<Vec3> entry = {};  ///< absent: the middle
  /// Lowest allowed height of the feet at this position, metres; empty: the cell's.
  std::function<double(const Vec3& feet)> ground = {};
};

/// Drives one avatar per cell and counts every violation of its cell.
struct CellFixture {
  World world;
  std::vector<Cell> cells;
  int moves = 0, outside = 0, penetrating = 0, blocked = 0;

  CellFixture(const Model& model, std::vector<Cell> inside, const WorldSettings& settings = {})
      : world(std::make_shared<const Scene>(model), settings), cells(std::move(inside)) {}

  std::string getName(std::size_t i) const { return "a" + std::to_string(100 + i); }

  void spawn(double height = 1.75, double radius = 0.3) {
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const Vec3 middle = 0.5 * (cells[i].min + cells[i].max);
      const Vec3 at = cells[i].entry.value_or(Vec3(middle.x(), cells[i].min.y(), middle.z()));
      Spawn spawn;
      spawn.position = at + Vec3(0, 0.01, 0);
      spawn.height = height;
      spawn.radius = radius;
      command(i, spawn);
    }
    const TickReport report = tickWorld(world);
    if (report.snapshot->avatars.size() != cells.size())
      throw std::runtime_error("not all came into the world: " + report.notices[0].text);
  }

  void command(std::size_t i, Order order) {
    if (const auto why = submitAvatarCommand(world, {getName(i), std::move(order), 0}))
      throw std::runtime_error(*why);
  }

  void moveRandomly(Seeded& random, int count) {
    for (int k = 0; k < count; ++k) {
      for (std::size_t i = 0; i < cells.size(); ++i) {
        const bool flies = i % 3 == 1;
        if (k == 0 && flies) command(i, Fly{});
        if (k % 3 == 1) command(i, Drive{drawVelocity(random, flies)});
        if (i % 3 == 2 && k % 7 == 3) command(i, Jump{random.drawUniform(0.05, 2.5)});
      }
      step(k % 16 == 0);
    }
  }

  void step(bool judgeAll) {
    const TickReport report = tickWorld(world);
    for (const AvatarSnapshot& avatar : report.snapshot->avatars) {
      ++moves;
      const Cell& cell = cells[std::stoul(avatar.name.substr(1)) - 100];
      const Aabb body = placeBox(avatar.shape->box, avatar.footPosition);
      outside += !contains(Aabb{cell.min, cell.max}, body);
      // The ground tolerance is the rounding of the file's floats.
      outside += cell.ground && avatar.footPosition.y() + 1e-6 < cell.ground(avatar.footPosition);
      blocked += avatar.move.blockedBy != 0;
    }
    penetrating += report.maxPenetration > 0;
    if (judgeAll) penetrating += countPenetrations(world);
  }
};

inline std::vector<Cell> addGridOfCells(Builder& b, int side, double size, double height,
                                        bool sliced) {
  std::vector<Cell> cells;
  for (int i = 0; i < side * side; ++i) {
    const Vec3 min{size * (i % side), 0, size * (i / side)};
    const Vec3 max = min + Vec3(size, height, size);
    addSheetCell(b, "cell" + std::to_string(i), min, max, sliced);
    cells.push_back({min, max});
  }
  return cells;
}

/// Rooms of panes one millimetre thick, with ledges, needles and plates in them.
inline std::vector<Cell> addPaneRooms(Builder& b, int count, Seeded& random) {
  std::vector<Cell> cells;
  for (int i = 0; i < count; ++i) {
    const Vec3 min{3.0 * i, 0, 0}, max{3.0 * i + 2.999, 3, 3};
    const std::string room = "room" + std::to_string(i);
    b.addBox(room + "/floor", min - Vec3(0.1, 0.2, 0.1), {max.x() + 0.1, 0, 3.1});
    b.addBox(room + "/roof", {min.x() - 0.1, 3, -0.1}, max + Vec3(0.1, 0.001, 0.1));
    b.addBox(room + "/south", min - Vec3(0, 0, 0.001), {max.x(), 3, 0});
    b.addBox(room + "/north", {min.x(), 0, 3}, max + Vec3(0, 0, 0.001));
    b.addBox(room + "/west", min - Vec3(0.001, 0, 0), {min.x(), 3, 3});
    b.addBox(room + "/east", {max.x(), 0, 0}, max + Vec3(0.001, 0, 0));
    for (int k = 0; k < 12; ++k) {
      const double x = min.x() + random.drawUniform(0, 2.9), z = random.drawUniform(0, 2.9);
      const bool whereOneEnters = std::abs(x - min.x() - 1.5) < 0.6 && std::abs(z - 1.5) < 0.6;
      if (whereOneEnters) continue;
      const double y = random.drawUniform(0, 2);
      b.addBox(room + "/bit" + std::to_string(k), {x, y, z},
               {x + random.drawUniform(1e-4, 0.1), y + random.drawUniform(1e-4, 0.4), z + 0.001});
    }
    cells.push_back({min, max});
  }
  return cells;
}

/// Pairs of rooms of sheets along z. The wall of zero thickness at x = 0 between two rooms has a
/// gap of `gap` metres in its middle.
inline std::vector<Cell> addGapRooms(Builder& b, int count, double gap) {
  std::vector<Cell> cells;
  for (int i = 0; i < count; ++i) {
    const double z = 2.0 * i, south = z - 1, north = z + 1;
    const Vec3 min{-1.5, 0, south}, max{1.5, 2.5, north};
    const std::string room = "rooms" + std::to_string(i);
    addSheetCell(b, room, min, max, false);
    const double left = z - 0.5 * gap, right = z + 0.5 * gap;
    b.addSheet(room + "/left", {{0, 0, south}, {0, 0, left}, {0, 2.5, left}, {0, 2.5, south}});
    b.addSheet(room + "/right", {{0, 0, right}, {0, 0, north}, {0, 2.5, north}, {0, 2.5, right}});
    cells.push_back({min, max, Vec3(-0.8, 0, z)});
  }
  return cells;
}

/// A straight flight of sheets of zero thickness between two side walls of sheets. It rises along
/// +x from x = 0, in the middle of z.
inline Cell addStairCell(Builder& b, const std::string& name, double riser, double tread, int steps,
                         double z) {
  const double top = riser * steps, end = tread * steps, south = z - 1, north = z + 1;
  const double roof = top + 4;
  const auto sheet = [&](const char* part, const std::vector<Vec3>& corners) {
    b.addSheet(name + "/" + part, corners);
  };
  const auto level = [&](const char* part, double x0, double x1, double y) {
    sheet(part, {{x0, y, south}, {x1, y, south}, {x1, y, north}, {x0, y, north}});
  };
  const auto across = [&](const char* part, double x, double y0, double y1) {
    sheet(part, {{x, y0, south}, {x, y1, south}, {x, y1, north}, {x, y0, north}});
  };
  for (int i = 0; i < steps; ++i) {
    level("tread", tread * i, tread * (i + 1), riser * (i + 1));
    across("riser", tread * i, riser * i, riser * (i + 1));
  }
  level("below", -2, 0, 0);
  level("above", end, end + 2, top);
  level("roof", -2, end + 2, roof);
  across("west", -2, -1, roof);
  across("east", end + 2, -1, roof);
  for (const double side : {south, north})
    sheet("side", {{-2, -1, side}, {end + 2, -1, side}, {end + 2, roof, side}, {-2, roof, side}});
  // Some surface must support the middle of the soles, whatever the path was.
  const auto ground = [=](const Vec3& feet) {
    return riser * std::max(0.0, std::min(double(steps), std::floor(feet.x() / tread) + 1));
  };
  return {{-2, 0, south}, {end + 2, roof, north}, Vec3(-1, 0, z), ground};
}

}  // namespace enfilade::scene::testing
