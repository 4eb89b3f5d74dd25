#include "server/navigation/shared_meshes.hpp"

#include <algorithm>
#include <bit>
#include <chrono>
#include <list>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "scene/import/cache/model_cache.hpp"
#include "scene/navigation/mesh/saved_meshes.hpp"
#include "server/base/load_scene.hpp"
#include "server/log/log.hpp"

namespace enfilade::server {
namespace {

constexpr std::size_t kMaxShared = 8;  // sizes

struct SharedMeshes {
  std::weak_ptr<const scene::Scene> scene;
  scene::WorldSettings settings;
  scene::NavigationAgent agent;
  bool doorsOpen = false;
  std::mutex mutex;                 ///< held while they are built
  std::vector<std::uint8_t> bytes;  ///< empty: not built yet
};

/// The meshes of a size in a scene; the oldest ones and those of scenes that ended are forgotten.
std::shared_ptr<SharedMeshes> findSharedMeshes(const MeshRequest& request, bool doorsOpen) {
  static std::mutex mutex;
  static std::list<std::shared_ptr<SharedMeshes>> all;  // the last one first
  const std::lock_guard lock(mutex);
  std::erase_if(all, [](const auto& one) { return one->scene.expired(); });
  const auto known = std::ranges::find_if(all, [&](const auto& one) {
    return one->scene.lock() == request.scene && one->settings == request.settings &&
           one->agent.radius == request.agent.radius && one->agent.height == request.agent.height &&
           one->doorsOpen == doorsOpen;
  });
  if (known != all.end()) return *known;
  auto added = std::make_shared<SharedMeshes>();
  added->scene = request.scene;
  added->settings = request.settings;
  added->agent = request.agent;
  added->doorsOpen = doorsOpen;
  all.push_front(added);
  if (all.size() > kMaxShared) all.pop_back();
  return added;
}

/// The meshes themselves say for which poses of bodies they are: update() builds the rest.
std::string makeCacheKey(const MeshRequest& request) {
  std::string key = "navigation mesh 1 scene " + std::to_string(request.scene->hash());
  for (const double number : {request.agent.radius, request.agent.height,
                              request.settings.stepHeight, request.settings.walkableNormalY})
    key += " " + std::to_string(std::bit_cast<std::uint64_t>(number));
  return key + (request.doorsOpen ? " open doors" : "");
}

std::unique_ptr<scene::Navigation> loadNavigation(const MeshRequest& request,
                                                  std::span<const std::uint8_t> bytes) {
  const auto start = std::chrono::steady_clock::now();
  auto navigation =
      std::make_unique<scene::Navigation>(request.scene, request.settings, request.agent, bytes);
  const std::size_t rebuilt = navigation->update(*request.snapshot, request.threads);
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  logInfo("navigation: meshes for radius {} m, height {} m read in {:.2f} s, {} tiles built",
          request.agent.radius, request.agent.height, seconds.count(), rebuilt);
  return navigation;
}

std::unique_ptr<scene::Navigation> readNavigation(const MeshRequest& request,
                                                  const scene::ModelCache& cache,
                                                  std::vector<std::uint8_t>& bytes) {
  std::string damage;
  const auto text = scene::loadCachedText(cache, makeCacheKey(request), &damage);
  if (!damage.empty()) logWarning("cache: {}; the navigation meshes are built again", damage);
  if (!text) return nullptr;
  try {
    bytes.assign(text->begin(), text->end());
    return loadNavigation(request, bytes);
  } catch (const scene::MeshFileError& error) {
    logWarning("cache: {}; the navigation meshes are built again", error.what());
    bytes.clear();
    return nullptr;
  }
}

/// From the meshes of the other state of the doors, if these are ready: only tiles with doors
/// differ.
std::unique_ptr<scene::Navigation> deriveNavigation(const MeshRequest& request) {
  const auto other = findSharedMeshes(request, !request.doorsOpen);
  const std::unique_lock lock(other->mutex, std::try_to_lock);
  if (!lock || other->bytes.empty()) return nullptr;
  return loadNavigation(request, other->bytes);
}

std::unique_ptr<scene::Navigation> buildNavigation(const MeshRequest& request,
                                                   const scene::Navigation::Progress& progress) {
  auto navigation =
      std::make_unique<scene::Navigation>(request.scene, request.settings, request.agent,
                                          request.snapshot.get(), request.threads, progress);
  const scene::NavigationReport report = navigation->report();
  logInfo("navigation: radius {} m, height {} m: {:.1f} m2 in {} islands, built in {:.2f} s",
          request.agent.radius, request.agent.height, report.area, report.islandAreas.size(),
          report.seconds);
  return navigation;
}

}  // namespace

std::unique_ptr<scene::Navigation> makeNavigation(const MeshRequest& request,
                                                  const scene::Navigation::Progress& progress) {
  const auto shared = findSharedMeshes(request, request.doorsOpen);
  const std::lock_guard lock(shared->mutex);
  if (!shared->bytes.empty()) return loadNavigation(request, shared->bytes);
  const auto cache = findCache(request.scene);
  if (cache)
    if (auto navigation = readNavigation(request, *cache, shared->bytes)) return navigation;
  auto navigation = deriveNavigation(request);
  if (!navigation) navigation = buildNavigation(request, progress);
  shared->bytes = navigation->save();
  if (!cache) return navigation;
  const std::string failure = scene::storeCachedText(
      *cache, makeCacheKey(request), std::string(shared->bytes.begin(), shared->bytes.end()));
  if (!failure.empty()) logWarning("cache: the navigation meshes are not kept: {}", failure);
  return navigation;
}

}  // namespace enfilade::server
