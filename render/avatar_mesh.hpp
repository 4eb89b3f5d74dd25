// Meshes of avatars: figures, or the collision hulls with a visor that shows the view direction.
#pragma once

#include <vector>

#include "render/draw_list.hpp"
#include "render/figure.hpp"
#include "render/vertex.hpp"

namespace enfilade::render {

/// Triangles of all avatars, in the order of the snapshot. Hulls are flat-shaded.
struct AvatarMeshes {
  /// One draw item: a figure, a hull or a visor.
  struct Item {
    MeshRange range;                      ///< figures of equal poses share one
    const scene::Mesh* figure = nullptr;  ///< the source of `range`; null: a hull or a visor
    Eigen::Affine3d worldFromMesh;
    scene::Aabb box;  ///< world
    scene::Material material;
    scene::EntityId id;
  };
  std::vector<Vertex> vertices;
  std::vector<std::uint32_t> indices;
  std::vector<Item> items;
};

/// Whether both avatars have the same meshes.
bool hasSameAppearance(const scene::AvatarSnapshot& a, const scene::AvatarSnapshot& b);

/// Meshes of all avatars.
AvatarMeshes buildAvatarMeshes(const std::vector<scene::AvatarSnapshot>& avatars, AvatarForm form);

/// Linear RGB; consecutive ids have very different colours.
Eigen::Vector3f getAvatarColour(scene::EntityId id);

/// Draw list of the given items, in this order.
DrawList buildAvatarDrawList(const AvatarMeshes& avatars, const Camera& camera,
                             const std::vector<std::uint32_t>& items);

}  // namespace enfilade::render
