// A seeded walk through any scene. Equal seeds give equal walks, whose images tests and benchmarks
// compare.
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <random>
#include <vector>

#include "render/camera/camera.hpp"
#include "scene/world/world.hpp"

namespace enfilade::tests {

struct WalkStop {
  std::shared_ptr<const scene::Snapshot> snapshot;
  render::Camera camera;       ///< at the eyes of `walker`; the caller sets its size
  scene::EntityId walker = 0;  ///< not drawn
};

class SeededWalk {
 public:
  SeededWalk(std::shared_ptr<const scene::Scene> scene, unsigned seed)
      : world_(std::move(scene)), random_(seed) {}

  /// Spawns `companions` and one more avatar near the middle of the scene, on ground; false if no
  /// ground was found.
  bool begin(int companions) {
    if (!standSomewhere("ann", 400)) return false;
    for (int i = 0; i < companions; ++i) standSomewhere("friend" + std::to_string(i), 5);
    heading_ = drawUniform(0, 2 * std::numbers::pi);
    return true;
  }

  /// Begins at a given place.
  bool beginAt(const collision::Vec3& footPosition, double heading) {
    heading_ = heading;
    return stand("ann", footPosition);
  }

  /// Walks for `ticks` ticks towards seeded goals and looks around at human speed. Empty if the
  /// walker has left the world.
  std::vector<WalkStop> walk(int ticks, double goalEverySeconds = 2) {
    std::vector<WalkStop> stops;
    const int goalEvery = static_cast<int>(goalEverySeconds * 60);
    for (int i = 0; i < ticks; ++i) {
      if (i % goalEvery == 0) {
        wanted_ = drawUniform(0, 2 * std::numbers::pi);
        const collision::Vec3 way(std::cos(wanted_), 0, std::sin(wanted_));
        for (const scene::AvatarSnapshot& avatar : world_.snapshot()->avatars)
          submitAvatarCommand(world_, {avatar.name, scene::Drive{1.5 * way}, 0});
      }
      const scene::TickReport report = tickWorld(world_);
      const auto& avatars = report.snapshot->avatars;
      const auto ann = std::find_if(avatars.begin(), avatars.end(),
                                    [](const auto& a) { return a.name == "ann"; });
      if (ann == avatars.end()) break;
      turn();
      WalkStop stop{report.snapshot, render::makeFirstPersonCamera(*ann, 64, 64), ann->id};
      stop.camera.forward =
          collision::Vec3(std::cos(heading_), 0.2 * std::sin(0.01 * i), std::sin(heading_));
      stops.push_back(std::move(stop));
    }
    return stops;
  }

 private:
  double drawUniform(double low, double high) {
    return low + (high - low) * (static_cast<double>(random_() >> 11) * 0x1p-53);
  }

  bool stand(const std::string& name, const collision::Vec3& footPosition) {
    const auto isThere = [&]() -> const scene::AvatarSnapshot* {
      for (const auto& avatar : world_.snapshot()->avatars)
        if (avatar.name == name) return &avatar;
      return nullptr;
    };
    if (submitAvatarCommand(world_, {name, scene::Spawn{footPosition}, 0})) return false;
    tickWorld(world_);
    if (!isThere()) return false;
    for (int i = 0; i < 60; ++i) tickWorld(world_);
    if (isThere() && isThere()->grounded) return true;
    submitAvatarCommand(world_, {name, scene::Leave{}, 0});
    tickWorld(world_);
    return false;
  }

  bool standSomewhere(const std::string& name, int attempts) {
    const scene::Aabb& b = world_.scene().bounds();
    for (int i = 0; i < attempts; ++i) {
      const double x = drawUniform(b.min.x() + 0.2 * b.size().x(), b.max.x() - 0.2 * b.size().x());
      const double z = drawUniform(b.min.z() + 0.2 * b.size().z(), b.max.z() - 0.2 * b.size().z());
      const double y = drawUniform(b.min.y(), b.min.y() + 0.7 * b.size().y());
      if (stand(name, {x, y, z})) return true;
    }
    return false;
  }

  /// Turns towards the direction of walking, at most 2 rad/s.
  void turn() {
    constexpr double kMaxTurn = 2.0 / 60;  // radians per tick
    heading_ +=
        std::clamp(std::remainder(wanted_ - heading_, 2 * std::numbers::pi), -kMaxTurn, kMaxTurn);
  }

  scene::World world_;
  std::mt19937_64 random_;
  double heading_ = 0, wanted_ = 0;  ///< radians about +Y, from +X to +Z
};

}  // namespace enfilade::tests
