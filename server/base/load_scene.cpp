#include "server/base/load_scene.hpp"

#include <chrono>
#include <mutex>
#include <vector>

#include "scene/import/bodies/collect_bodies.hpp"
#include "scene/import/cache/model_cache.hpp"
#include "scene/model/diagnostic_catalog.hpp"
#include "server/base/progress.hpp"
#include "server/log/log.hpp"

namespace enfilade::server {
namespace {

void logLoadedScene(const scene::Scene& scene, const std::string& name, const LoadedScene& loaded) {
  const scene::Model& model = scene.model();
  const scene::Vec3 size =
      scene.bounds().empty() ? scene::Vec3::Zero().eval() : scene.bounds().size();
  logInfo(
      "{}: {} objects, {:.1f} x {:.1f} x {:.1f} m, unit {} m, up {}, read by {}, {} in {:.2f} s",
      name, model.objects.size(), size.x(), size.y(), size.z(), model.metresPerUnit,
      toString(model.upAxis), model.reader, loaded.fromCache ? "from the cache" : "imported",
      loaded.loadSeconds);
}

struct CachedScene {
  std::weak_ptr<const scene::Scene> scene;
  scene::ModelCache cache;
};

struct CachedScenes {
  std::mutex mutex;
  std::vector<CachedScene> list;
};

CachedScenes& getSceneRegistry() {
  static CachedScenes scenes;
  return scenes;
}

void keepCache(const std::shared_ptr<const scene::Scene>& loaded, const scene::ModelCache& cache) {
  CachedScenes& scenes = getSceneRegistry();
  const std::lock_guard lock(scenes.mutex);
  std::erase_if(scenes.list, [](const CachedScene& one) { return one.scene.expired(); });
  scenes.list.push_back({loaded, cache});
}

}  // namespace

std::optional<scene::ModelCache> findCache(const std::shared_ptr<const scene::Scene>& scene) {
  CachedScenes& scenes = getSceneRegistry();
  const std::lock_guard lock(scenes.mutex);
  for (const CachedScene& one : scenes.list)
    if (one.scene.lock() == scene) return one.cache;
  return std::nullopt;
}

LoadedScene loadSceneTimed(const ModelOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  Progress bar;
  const auto cache = options.cache ? scene::findDefaultModelCache() : std::nullopt;
  scene::LoadedModel model = scene::loadModel(
      options.file, options.import, cache,
      [&](const std::string& stage, double fraction) { bar.show(fraction, stage); });
  bar.clear();
  for (const std::string& note : model.notes) logWarning("cache: {}", note);
  scene::collectBodies(model.model, options.file, options.doors);
  if (!model.model.bodies.empty())
    logInfo("{}: {} bodies: {}", options.file.filename().string(), model.model.bodies.size(),
            scene::formatBodySources(model.model));
  LoadedScene loaded{nullptr, model.fromCache, model.importSeconds, 0};
  loaded.scene = std::make_shared<const scene::Scene>(std::move(model.model));
  if (cache) keepCache(loaded.scene, *cache);
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
  loaded.loadSeconds = elapsed.count();
  logLoadedScene(*loaded.scene, options.file.filename().string(), loaded);
  return loaded;
}

std::shared_ptr<const scene::Scene> loadScene(const ModelOptions& options) {
  std::shared_ptr<const scene::Scene> scene = loadSceneTimed(options).scene;
  for (const scene::Diagnostic& problem : scene->model().diagnostics)
    logInfo("{}: {} ({}, {}), for example {}", options.file.filename().string(),
            scene::findDiagnosticKind(problem).meaning, problem.kind, problem.count,
            problem.example);
  return scene;
}

}  // namespace enfilade::server
