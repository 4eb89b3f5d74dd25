#include "server/navigation/shared_meshes.hpp"

#include <algorithm>
#include <bit>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <list>
#include <mutex>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "scene/import/cache/model_cache.hpp"
#include "scene/navigation/mesh/saved_meshes.hpp"
#include "server/base/load_scene.hpp"
#include "server/log/log.hpp"

namespace enfilade::server {
namespace {

using Progress = scene::Navigation::Progress;
using Bytes = std::vector<std::uint8_t>;

constexpr std::size_t kMaxShared = 8;  // sizes

struct SharedMeshes {
  std::weak_ptr<const scene::Scene> scene;
  scene::WorldSettings settings;
  scene::NavigationAgent agent;
  bool doorsOpen = false;
  std::mutex mutex;  ///< of the members below
  std::condition_variable changed;
  bool isBuilding = false;             ///< a thread builds them; the others wait
  double share = 0;                    ///< that it has built, 0..1
  std::shared_ptr<const Bytes> bytes;  ///< null: not built yet
};

/// Waits while another thread builds the meshes, and reports its progress; then it is the caller's
/// turn, unless they are built.
class BuildTurn {
 public:
  BuildTurn(SharedMeshes& shared, const Progress& progress) : shared_(shared) {
    std::unique_lock lock(shared_.mutex);
    while (shared_.isBuilding) {
      const double share = shared_.share;
      lock.unlock();
      if (progress) progress(scene::Navigation::kTileShare * share);  // then it loads them
      lock.lock();
      shared_.changed.wait(lock, [&] { return !shared_.isBuilding || shared_.share != share; });
    }
    if (shared_.bytes) return;
    shared_.isBuilding = isMine_ = true;
    shared_.share = 0;
  }
  ~BuildTurn() {
    if (!isMine_) return;
    const std::lock_guard lock(shared_.mutex);
    shared_.isBuilding = false;
    shared_.changed.notify_all();
  }
  BuildTurn(const BuildTurn&) = delete;
  BuildTurn& operator=(const BuildTurn&) = delete;

  bool isMine() const { return isMine_; }
  void report(double share) {
    const std::lock_guard lock(shared_.mutex);
    shared_.share = share;
    shared_.changed.notify_all();
  }
  void keep(std::shared_ptr<const Bytes> bytes) {
    const std::lock_guard lock(shared_.mutex);
    shared_.bytes = std::move(bytes);
  }

 private:
  SharedMeshes& shared_;
  bool isMine_ = false;
};

std::shared_ptr<const Bytes> getBytes(SharedMeshes& shared) {
  const std::lock_guard lock(shared.mutex);
  return shared.bytes;
}

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
  std::string key = "navigation mesh 3 scene " + std::to_string(request.scene->hash());
  for (const double number : {request.agent.radius, request.agent.height,
                              request.settings.stepHeight, request.settings.walkableNormalY})
    key += " " + std::to_string(std::bit_cast<std::uint64_t>(number));
  return key + (request.doorsOpen ? " open doors" : "");
}

std::unique_ptr<scene::Navigation> loadNavigation(const MeshRequest& request,
                                                  std::span<const std::uint8_t> bytes,
                                                  const Progress& progress) {
  const auto start = std::chrono::steady_clock::now();
  auto navigation = std::make_unique<scene::Navigation>(
      request.scene, request.settings, request.agent, bytes, request.threads, progress);
  const std::size_t rebuilt = navigation->update(*request.snapshot, request.threads, progress);
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  logInfo("navigation: meshes for radius {} m, height {} m read in {:.2f} s, {} tiles built",
          request.agent.radius, request.agent.height, seconds.count(), rebuilt);
  return navigation;
}

std::unique_ptr<scene::Navigation> readNavigation(const MeshRequest& request,
                                                  const scene::ModelCache& cache, Bytes& bytes,
                                                  const Progress& progress) {
  std::string damage;
  const auto text = scene::loadCachedText(cache, makeCacheKey(request), &damage);
  if (!damage.empty()) logWarning("cache: {}; the navigation meshes are built again", damage);
  if (!text) return nullptr;
  try {
    bytes.assign(text->begin(), text->end());
    return loadNavigation(request, bytes, progress);
  } catch (const scene::MeshFileError& error) {
    logWarning("cache: {}; the navigation meshes are built again", error.what());
    return nullptr;
  }
}

/// From the meshes of the other state of the doors, if these are ready: only tiles with doors
/// differ.
std::unique_ptr<scene::Navigation> deriveNavigation(const MeshRequest& request,
                                                    const Progress& progress) {
  const auto bytes = getBytes(*findSharedMeshes(request, !request.doorsOpen));
  return bytes ? loadNavigation(request, *bytes, progress) : nullptr;
}

std::unique_ptr<scene::Navigation> buildNavigation(const MeshRequest& request,
                                                   const Progress& progress) {
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
                                                  const Progress& progress) {
  const auto shared = findSharedMeshes(request, request.doorsOpen);
  BuildTurn turn(*shared, progress);
  if (!turn.isMine()) return loadNavigation(request, *getBytes(*shared), progress);
  const auto report = [&](double share) {
    turn.report(share);
    if (progress) progress(share);
  };
  const auto cache = findCache(request.scene);
  Bytes bytes;
  auto navigation = cache ? readNavigation(request, *cache, bytes, report) : nullptr;
  const bool isRead = navigation != nullptr;
  if (!navigation) navigation = deriveNavigation(request, report);
  if (!navigation) navigation = buildNavigation(request, report);
  if (!isRead) bytes = navigation->save();
  const auto kept = std::make_shared<const Bytes>(std::move(bytes));
  turn.keep(kept);
  if (!cache || isRead) return navigation;
  const std::string failure = scene::storeCachedText(*cache, makeCacheKey(request),
                                                     std::string(kept->begin(), kept->end()));
  if (!failure.empty()) logWarning("cache: the navigation meshes are not kept: {}", failure);
  return navigation;
}

}  // namespace enfilade::server
