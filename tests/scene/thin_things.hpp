// Closed rooms of things that are easily slipped through, and the exact answer to whether anything
// was: every triangle against every part by the narrow phase, and on which side of each sheet.
#pragma once

#include <cmath>
#include <memory>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "collision/narrow_phase.hpp"
#include "scene/world.hpp"
#include "tests/scene/box_scene.hpp"

namespace enfilade::scene::testing {

class Seeded {
 public:
  explicit Seeded(std::uint64_t seed) : random_(seed) {}
  double uniform(double low, double high) {
    return low + (high - low) * (static_cast<double>(random_() >> 11) * 0x1p-53);
  }
  int below(int bound) { return static_cast<int>(random_() % static_cast<std::uint64_t>(bound)); }

 private:
  std::mt19937_64 random_;
};

/// A model put together of triangles and boxes.
struct Builder {
  Model model;

  Builder() {
    model.source = "thin things";
    model.materials.emplace_back();
  }
  void add(const std::string& path, Mesh mesh) {
    model.meshes.push_back(std::move(mesh));
    model.objects.push_back({path,
                             "",
                             {static_cast<std::uint32_t>(model.meshes.size() - 1)},
                             Eigen::Affine3d::Identity()});
  }
  void box(const std::string& path, const Vec3& min, const Vec3& max) {
    add(path, boxMesh(min, max));
  }
  /// A sheet of no thickness: four corners in order.
  void sheet(const std::string& path, const std::vector<Vec3>& corners) {
    Mesh mesh;
    for (const Vec3& corner : corners) mesh.positions.push_back(corner.cast<float>());
    mesh.indices = {0, 1, 2, 0, 2, 3};
    add(path, std::move(mesh));
  }
  /// The same sheet cut into slivers from its first corner: all triangles long and thin.
  void slivers(const std::string& path, const std::vector<Vec3>& corners, int count) {
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

/// Side walls, roof and floor of one cell, of sheets: x and z in [x, x + size] x [z, z + size].
inline void sheetCell(Builder& b, const std::string& name, const Vec3& min, const Vec3& max,
                      bool sliced) {
  const auto wall = [&](const std::string& side, const std::vector<Vec3>& corners) {
    if (sliced) {
      b.slivers(name + side, corners, 9);
    } else {
      b.sheet(name + side, corners);
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

/// The verdict on every part of every avatar with every triangle and hull of the scene and every
/// part of the others: how many are not separated. Takes nothing of what the tick keeps.
inline int penetrations(const World& world) {
  const auto& avatars = world.snapshot()->avatars;
  std::vector<std::vector<collision::Triangle>> triangles;
  std::vector<std::pair<Box, collision::ConvexBody>> still;
  for (const std::uint32_t object : world.scene().solidObjects()) {
    triangles.push_back(solidTriangles(world.scene().model(), object));
    for (const collision::Triangle& t : triangles.back())
      still.push_back({collision::boxOf(t), {std::span<const Vec3>(t), Vec3::Zero()}});
    const ObjectParts& parts = world.scene().parts(object);
    for (std::uint32_t i = 0; i < parts.hullCount(); ++i)
      still.push_back({parts.box(i), parts.body(i)});
  }
  int found = 0;
  const auto judge = [&](const collision::ConvexBody& a, const Box& boxA,
                         const collision::ConvexBody& b, const Box& boxB) {
    if (!overlaps(boxA, boxB)) return;  // the boxes are exact or larger
    collision::FeatureCache cache;
    found += collision::decide(a, b, cache).verdict != collision::Verdict::separated;
  };
  for (std::size_t i = 0; i < avatars.size(); ++i) {
    for (const AvatarPart& part : avatars[i].shape->parts) {
      const collision::ConvexBody body = bodyAt(part, avatars[i].feet);
      const Box box = grown(boxAt(part.box, avatars[i].feet), 1e-9);
      for (const auto& [otherBox, other] : still) judge(body, box, other, otherBox);
      for (std::size_t k = i + 1; k < avatars.size(); ++k)
        for (const AvatarPart& other : avatars[k].shape->parts)
          judge(body, box, bodyAt(other, avatars[k].feet),
                grown(boxAt(other.box, avatars[k].feet), 1e-9));
    }
  }
  return found;
}

inline double randomSpeed(Seeded& random) {
  return 0.01 * std::pow(10.0, random.uniform(0, 5));
}

/// A velocity for a walker, now and then straight at a wall.
inline Vec3 randomVelocity(Seeded& random, bool flies) {
  const double angle =
      random.below(4) == 0 ? 0.5 * 3.14159265358979 * random.below(4) : random.uniform(0, 6.2832);
  const double speed = randomSpeed(random);
  const double up = flies ? random.uniform(-1, 1) : 0;
  return speed * Vec3(std::cos(angle), up, std::sin(angle)).normalized();
}

struct Cell {
  Vec3 min, max;
};

/// Drives one avatar a cell about and holds it to its cell; what goes wrong is counted.
struct CellTrial {
  World world;
  std::vector<Cell> cells;
  int moves = 0, outside = 0, penetrating = 0, blocked = 0;

  CellTrial(const Model& model, std::vector<Cell> inside, const Lengths& lengths = {})
      : world(std::make_shared<const Scene>(model), lengths), cells(std::move(inside)) {}

  std::string name(std::size_t i) const { return "a" + std::to_string(100 + i); }

  void spawn(double height = 1.75, double radius = 0.3) {
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const Vec3 middle = 0.5 * (cells[i].min + cells[i].max);
      Spawn spawn;
      spawn.at = {middle.x(), cells[i].min.y() + 0.01, middle.z()};
      spawn.height = height;
      spawn.radius = radius;
      command(i, spawn);
    }
    const TickReport report = tick(world);
    if (report.snapshot->avatars.size() != cells.size())
      throw std::runtime_error("not all came into the world: " + report.notices[0].text);
  }

  void command(std::size_t i, Order order) {
    if (const auto why = submit(world, {name(i), std::move(order), 0}))
      throw std::runtime_error(*why);
  }

  void randomMoves(Seeded& random, int count) {
    for (int k = 0; k < count; ++k) {
      for (std::size_t i = 0; i < cells.size(); ++i) {
        const bool flies = i % 3 == 1;
        if (k == 0 && flies) command(i, Fly{});
        if (k % 3 == 1) command(i, Drive{randomVelocity(random, flies)});
        if (i % 3 == 2 && k % 7 == 3) command(i, Jump{random.uniform(0.05, 2.5)});
      }
      step(k % 16 == 0);
    }
  }

  void step(bool judgeAll) {
    const TickReport report = tick(world);
    for (const AvatarView& avatar : report.snapshot->avatars) {
      ++moves;
      const Cell& cell = cells[std::stoul(avatar.name.substr(1)) - 100];
      const Box body = boxAt(avatar.shape->box, avatar.feet);
      outside += !contains(Box{cell.min, cell.max}, body);
      blocked += avatar.move.stoppedBy != 0;
    }
    penetrating += report.worstPenetration > 0;
    if (judgeAll) penetrating += penetrations(world);
  }
};

inline std::vector<Cell> gridOfCells(Builder& b, int side, double size, double height,
                                     bool sliced) {
  std::vector<Cell> cells;
  for (int i = 0; i < side * side; ++i) {
    const Vec3 min{size * (i % side), 0, size * (i / side)};
    const Vec3 max = min + Vec3(size, height, size);
    sheetCell(b, "cell" + std::to_string(i), min, max, sliced);
    cells.push_back({min, max});
  }
  return cells;
}

}  // namespace enfilade::scene::testing
