// A plan of the scene, a picture a storey, with what happened in a walk drawn on it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "scene/world/data/scene.hpp"
#include "server/plans/plan_image.hpp"

namespace enfilade::server {

/// Where an avatar's feet were, tick by tick; scene frame, metres.
struct WalkedPath {
  std::string avatar;
  std::vector<Vec3> feet;
  scene::EntityId id = 0;  ///< its colour is that of the avatar in the pictures
};
struct MapContact {
  Vec3 point = Vec3::Zero();
  Vec3 normal = Vec3::UnitY();
};
struct MapCapture {
  std::string name;
  Vec3 eye = Vec3::Zero();
  Vec3 gaze = Vec3::UnitX();
};

struct WalkTrace {
  std::string title;
  std::vector<WalkedPath> paths;
  std::vector<MapContact> contacts;  ///< that began
  std::vector<MapContact> stops;     ///< where a walk ended blocked
  std::vector<MapCapture> captures;
};

/// Heights of the floors that were walked on for long, ascending; empty when nobody walked.
std::vector<double> walkedStoreys(const std::vector<WalkedPath>& paths);

/// What a map is drawn on.
struct MapGround {
  TakePicture picture;
  const scene::Scene* scene = nullptr;  ///< whose walls get their lines; null: it is elsewhere
};

/// nullopt when there is nothing to draw or no picture to draw on.
std::optional<render::Image> drawMap(const WalkTrace& trace, const MapGround& ground);

}  // namespace enfilade::server
