#include "render/culling/visible_items.hpp"

#include <algorithm>
#include <iterator>

#include "collision/assert.hpp"

namespace enfilade::render {
namespace {

// Updates between retests of a visible item, and until an item outside the frustum is forgotten.
constexpr std::uint64_t kRetestPeriod = 8, kForgetCulledPeriod = 64;

bool isInFrustum(const ViewTests& view, const scene::Aabb& box) {
  return !view.visibility.isOutsideFrustum(view.visibility.toEyeSpace(box));
}

Visibility testBox(const ViewTests& view, const scene::Aabb& box) {
  return view.visibility.test(view.visibility.toEyeSpace(box), view.depth);
}

bool mayBeVisible(const ViewTests& view, const scene::Aabb& box) {
  return testBox(view, box) == Visibility::visible;
}

bool isHidden(const SceneItems& scene, const ViewTests& view, std::uint32_t item) {
  return scene.items[item].object + 1 == view.hiddenEntity;
}

/// Indices of the avatar items that are not hidden and that `accept` takes.
template <class Accept>
std::vector<std::uint32_t> selectAvatarItems(const SceneItems& scene, const ViewTests& view,
                                             const Accept& accept) {
  std::vector<std::uint32_t> selected;
  for (std::uint32_t i = 0; i < scene.avatarItems.size(); ++i)
    if (scene.avatarItems[i].id != view.hiddenEntity && accept(i)) selected.push_back(i);
  return selected;
}

}  // namespace

VisibleSet findInFrustum(const SceneItems& scene, const ViewTests& view) {
  VisibleSet all;
  for (std::uint32_t item = 0; item < scene.items.size(); ++item)
    if (!isHidden(scene, view, item) && isInFrustum(view, scene.computeAabb(item)))
      all.items.push_back(item);
  all.avatarItems = selectAvatarItems(
      scene, view, [&](std::uint32_t i) { return isInFrustum(view, scene.avatarItems[i].box); });
  return all;
}

VisibleSet predictVisible(const SceneItems& scene, const ViewTests& view,
                          const CachedView& cached) {
  ENFILADE_ASSERT(std::ranges::is_sorted(cached.items) && std::ranges::is_sorted(cached.avatars));
  VisibleSet predicted;
  for (const std::uint32_t item : cached.items)
    if (!isHidden(scene, view, item) && isInFrustum(view, scene.computeAabb(item)))
      predicted.items.push_back(item);
  predicted.avatarItems = selectAvatarItems(scene, view, [&](std::uint32_t i) {
    return std::ranges::binary_search(cached.avatars, scene.avatarItems[i].id) &&
           isInFrustum(view, scene.avatarItems[i].box);
  });
  return predicted;
}

std::vector<std::uint32_t> findDisoccludedAvatars(const SceneItems& scene, const ViewTests& view,
                                                  const VisibleSet& drawn) {
  return selectAvatarItems(scene, view, [&](std::uint32_t i) {
    return !std::ranges::binary_search(drawn.avatarItems, i) &&
           mayBeVisible(view, scene.avatarItems[i].box);
  });
}

VisibleSet filterVisible(const SceneItems& scene, const ViewTests& view, const VisibleSet& drawn) {
  VisibleSet visible;
  visible.avatarItems = drawn.avatarItems;
  for (const std::uint32_t item : drawn.items)
    if (mayBeVisible(view, scene.computeAabb(item))) visible.items.push_back(item);
  return visible;
}

void updateCachedView(const SceneItems& scene, const ViewTests& view, const VisibleSet& drawn,
                      CachedView& cached) {
  ENFILADE_ASSERT(std::ranges::is_sorted(drawn.items) && std::ranges::is_sorted(drawn.avatarItems));
  const std::uint64_t update = ++cached.updates;
  std::vector<std::uint32_t> kept;
  for (const std::uint32_t item : drawn.items) {
    const bool due = cached.items.empty() || (item + update) % kRetestPeriod == 0;
    if (!due || testBox(view, scene.computeAabb(item)) != Visibility::occluded)
      kept.push_back(item);
  }
  for (const std::uint32_t item : cached.items) {
    if (std::ranges::binary_search(drawn.items, item)) continue;
    if ((item + update) % kForgetCulledPeriod != 0) kept.push_back(item);
  }
  std::ranges::sort(kept);
  cached.items = std::move(kept);
  cached.avatars.clear();
  for (const std::uint32_t avatarItem : drawn.avatarItems)
    cached.avatars.push_back(scene.avatarItems[avatarItem].id);
  std::ranges::sort(cached.avatars);
}

void mergeSorted(std::vector<std::uint32_t>& all, const std::vector<std::uint32_t>& more) {
  ENFILADE_ASSERT(std::ranges::is_sorted(all) && std::ranges::is_sorted(more));
  std::vector<std::uint32_t> merged;
  merged.reserve(all.size() + more.size());
  std::ranges::set_union(all, more, std::back_inserter(merged));
  all = std::move(merged);
}

}  // namespace enfilade::render
