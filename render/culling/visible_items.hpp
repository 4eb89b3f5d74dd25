// The items of a scene that a view draws, by its frustum, by its depth and by earlier frames.
// Independent of OpenGL.
#pragma once

#include <span>

#include "render/avatar_mesh.hpp"
#include "render/culling/occlusion_culler.hpp"
#include "render/culling/visibility_cache.hpp"

namespace enfilade::render {

/// Model items and avatar items to draw.
struct VisibleSet {
  std::vector<std::uint32_t> items;        ///< ascending
  std::vector<std::uint32_t> avatarItems;  ///< indices into AvatarMeshes::items, ascending
};

/// The items of a scene at one snapshot.
struct SceneItems {
  std::span<const DrawItem> items;
  const std::vector<BodyPlacement>& bodies;
  const std::vector<AvatarMeshes::Item>& avatarItems;

  scene::Aabb computeAabb(std::uint32_t item) const { return computeItemAabb(items[item], bodies); }
};

/// Tests of one view. `depth` is only for tests of occlusion.
struct ViewTests {
  const BoxVisibility& visibility;
  const DepthPyramid& depth;
  scene::EntityId hiddenEntity;
};

/// All items in the frustum.
VisibleSet findInFrustum(const SceneItems& scene, const ViewTests& view);

/// Items of the cached view that are in the frustum.
VisibleSet predictVisible(const SceneItems& scene, const ViewTests& view, const CachedView& cached);

/// Avatar items other than those of `drawn` that are possibly visible.
std::vector<std::uint32_t> findDisoccludedAvatars(const SceneItems& scene, const ViewTests& view,
                                                  const VisibleSet& drawn);

/// The items of `drawn` that are possibly visible; all of its avatars.
VisibleSet filterVisible(const SceneItems& scene, const ViewTests& view, const VisibleSet& drawn);

/// Updates the cached view for the next frame: the drawn items without those now occluded, and
/// previously visible items that are outside the frustum now. The tests of items are spread over
/// updates.
void updateCachedView(const SceneItems& scene, const ViewTests& view, const VisibleSet& drawn,
                      CachedView& cached);

/// Adds `more` to `all`; both are ascending.
void mergeSorted(std::vector<std::uint32_t>& all, const std::vector<std::uint32_t>& more);

}  // namespace enfilade::render
