#include "server/navigation/shared_meshes.hpp"

#include <algorithm>
#include <list>
#include <mutex>
#include <vector>

namespace enfilade::server {
namespace {

constexpr std::size_t kMaxShared = 8;  // sizes

struct SharedMeshes {
  std::weak_ptr<const scene::Scene> scene;
  scene::WorldSettings settings;
  scene::NavigationAgent agent;
  std::mutex mutex;                 ///< held while they are built
  std::vector<std::uint8_t> bytes;  ///< empty: not built yet
};

/// The meshes of a size in a scene; the oldest ones and those of scenes that ended are forgotten.
std::shared_ptr<SharedMeshes> findSharedMeshes(const std::shared_ptr<const scene::Scene>& scene,
                                               const scene::WorldSettings& settings,
                                               const scene::NavigationAgent& agent) {
  static std::mutex mutex;
  static std::list<std::shared_ptr<SharedMeshes>> all;  // the last one first
  const std::lock_guard lock(mutex);
  std::erase_if(all, [](const auto& one) { return one->scene.expired(); });
  const auto known = std::ranges::find_if(all, [&](const auto& one) {
    return one->scene.lock() == scene && one->settings == settings &&
           one->agent.radius == agent.radius && one->agent.height == agent.height;
  });
  if (known != all.end()) return *known;
  auto added = std::make_shared<SharedMeshes>();
  added->scene = scene;
  added->settings = settings;
  added->agent = agent;
  all.push_front(added);
  if (all.size() > kMaxShared) all.pop_back();
  return added;
}

}  // namespace

std::unique_ptr<scene::Navigation> makeNavigation(const std::shared_ptr<const scene::Scene>& scene,
                                                  const scene::WorldSettings& settings,
                                                  const scene::NavigationAgent& agent,
                                                  const scene::Snapshot& snapshot) {
  const auto shared = findSharedMeshes(scene, settings, agent);
  const std::lock_guard lock(shared->mutex);
  if (!shared->bytes.empty()) {
    auto navigation = std::make_unique<scene::Navigation>(scene, settings, agent, shared->bytes);
    navigation->update(snapshot);
    return navigation;
  }
  auto navigation = std::make_unique<scene::Navigation>(scene, settings, agent, &snapshot);
  shared->bytes = navigation->save();
  return navigation;
}

}  // namespace enfilade::server
