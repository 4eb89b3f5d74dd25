// Data of a walk that maps show: paths of avatars, contacts and captures.
#pragma once

#include <string>
#include <vector>

#include "scene/world/data/snapshot.hpp"
#include "server/plans/plan_image.hpp"

namespace enfilade::server {

/// The positions of an avatar's feet, tick by tick; scene frame, metres.
struct WalkedPath {
  std::string avatar;
  std::vector<Vec3> footPositions;
  scene::EntityId id = 0;  ///< selects the avatar's colour
  bool isEarlier = false;  ///< of the walk that another one is compared with: pale and dashed
};
struct MapContact {
  Vec3 point = Vec3::Zero();
  Vec3 normal = Vec3::UnitY();
};
struct MapCapture {
  std::string name;
  Vec3 eye = Vec3::Zero();
  Vec3 viewDirection = Vec3::UnitX();
};

struct WalkTrace {
  std::string title;
  std::vector<WalkedPath> paths;
  std::vector<MapContact> contacts;      ///< contacts that began
  std::vector<MapContact> blockedWalks;  ///< ends of blocked walks; what is in the way
  /// Shown where they are near: a Spawn may name any place.
  std::vector<MapContact> refusedOrders = {};
  std::vector<MapCapture> captures;
  /// metres: heights that get a plan, however little walking is there
  std::vector<double> floors = {};
};

}  // namespace enfilade::server
