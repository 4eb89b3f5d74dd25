// Loads a model file as a scene and shows the progress.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>

#include "scene/import/bodies/collect_bodies.hpp"
#include "scene/import/cache/model_cache.hpp"
#include "scene/import/import_model.hpp"
#include "scene/world/data/scene.hpp"

namespace enfilade::server {

/// A model file and how to import it.
struct ModelOptions {
  std::filesystem::path file;
  scene::ImportOptions import;
  bool cache = true;  ///< use a cached import
  scene::IfcDoors doors = scene::IfcDoors::movable;
};

struct LoadedScene {
  std::shared_ptr<const scene::Scene> scene;
  bool fromCache = false;
  double importSeconds = 0;  ///< duration of the import, now or when the cache entry was written
  double loadSeconds = 0;    ///< duration of this load, from file to scene
};

/// Throws scene::ImportError.
LoadedScene loadSceneTimed(const ModelOptions& options);
/// Like loadSceneTimed(), and logs the diagnostics of the import.
std::shared_ptr<const scene::Scene> loadScene(const ModelOptions& options);

/// The cache with which a scene was loaded, for what is derived from it; nullopt: without, or it
/// was not loaded from a file. Thread-safe.
std::optional<scene::ModelCache> findCache(const std::shared_ptr<const scene::Scene>& scene);

}  // namespace enfilade::server
