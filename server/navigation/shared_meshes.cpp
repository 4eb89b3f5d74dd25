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
  std::vector<std::uint8_t> bytes;
};

}  // namespace

std::unique_ptr<scene::Navigation> makeNavigation(const std::shared_ptr<const scene::Scene>& scene,
                                                  const scene::WorldSettings& settings,
                                                  const scene::NavigationAgent& agent,
                                                  const scene::Snapshot& snapshot) {
  static std::mutex mutex;
  static std::list<SharedMeshes> shared;  // the last one first
  const std::lock_guard lock(mutex);
  std::erase_if(shared, [](const SharedMeshes& one) { return one.scene.expired(); });
  const auto known = std::ranges::find_if(shared, [&](const SharedMeshes& one) {
    return one.scene.lock() == scene && one.settings == settings &&
           one.agent.radius == agent.radius && one.agent.height == agent.height;
  });
  if (known != shared.end()) {
    auto navigation = std::make_unique<scene::Navigation>(scene, settings, agent, known->bytes);
    navigation->update(snapshot);
    return navigation;
  }
  auto navigation = std::make_unique<scene::Navigation>(scene, settings, agent, &snapshot);
  shared.push_front({scene, settings, agent, navigation->save()});
  if (shared.size() > kMaxShared) shared.pop_back();
  return navigation;
}

}  // namespace enfilade::server
