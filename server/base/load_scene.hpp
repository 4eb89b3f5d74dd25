// A model file as a scene, with its progress told.
#pragma once

#include <memory>

#include "scene/world/data/scene.hpp"
#include "server/app/command_line.hpp"

namespace enfilade::server {

struct LoadedScene {
  std::shared_ptr<const scene::Scene> scene;
  bool fromCache = false;
  double importSeconds = 0;  ///< that the import took, now or when the cache's entry was made
  double loadSeconds = 0;    ///< from the file to the scene, now
};

/// Throws scene::ImportError.
LoadedScene loadSceneTimed(const ModelOptions& options);
/// The same, and logs the problems that the import met.
std::shared_ptr<const scene::Scene> loadScene(const ModelOptions& options);

}  // namespace enfilade::server
