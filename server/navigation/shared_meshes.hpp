// Navigation meshes that the worlds of a scene share, and that the next start of the program finds
// in the model cache.
#pragma once

#include <memory>

#include "scene/navigation/navigation.hpp"

namespace enfilade::server {

/// Names the wanted meshes.
struct MeshRequest {
  std::shared_ptr<const scene::Scene> scene;
  scene::WorldSettings settings;
  scene::NavigationAgent agent;
  bool doorsOpen = false;                           ///< in `snapshot`; decides what is shared
  std::shared_ptr<const scene::Snapshot> snapshot;  ///< poses of the bodies
  int threads = 2;
};

/// A navigation of a size. The first world of a scene builds its meshes, or reads them from the
/// cache with which the scene was loaded. Others share these, and build the tiles around bodies
/// that stand elsewhere. Thread-safe: a second caller for the same meshes waits for the first, and
/// reports its progress meanwhile; others do not wait.
std::unique_ptr<scene::Navigation> makeNavigation(const MeshRequest& request,
                                                  const scene::Navigation::Progress& progress = {});

}  // namespace enfilade::server
