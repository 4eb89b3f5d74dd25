// Meshes of avatars: the collision hull with a visor that shows the view direction.
#pragma once

#include <vector>

#include "render/draw_list.hpp"
#include "render/vertex.hpp"

namespace enfilade::render {

/// Flat-shaded triangles of all avatars, in the order of the snapshot.
struct AvatarMeshes {
  /// One draw item: a hull or a visor.
  struct Item {
    MeshRange range;  ///< positions relative to footPosition
    Vec3 footPosition;
    scene::Aabb box;  ///< world
    MaterialData material;
    scene::EntityId id;
  };
  std::vector<Vertex> vertices;
  std::vector<std::uint32_t> indices;
  std::vector<Item> items;
};

/// Whether both avatars have the same meshes.
bool hasSameAppearance(const scene::AvatarSnapshot& a, const scene::AvatarSnapshot& b);

/// Meshes of all avatars except `hiddenEntity`.
AvatarMeshes buildAvatarMeshes(const scene::Snapshot& snapshot, scene::EntityId hiddenEntity);

/// Linear RGB; consecutive ids have very different colours.
Eigen::Vector3f avatarColour(scene::EntityId id);

/// Draw list of the given items, in this order.
DrawList buildAvatarDrawList(const AvatarMeshes& avatars, const Camera& camera,
                             const std::vector<std::uint32_t>& items);

}  // namespace enfilade::render
