// What people look like to one another: their hull, with a visor that shows where they look.
#pragma once

#include <vector>

#include "render/draw_list.hpp"
#include "render/vertex.hpp"

namespace enfilade::render {

/// Flat-shaded triangles of all avatars, in the order of the snapshot.
struct AvatarMeshes {
  struct Piece {
    MeshRange range;  ///< relative to the feet
    Vec3 feet;
    scene::Box box;  ///< world
    MaterialData material;
    scene::EntityId id;
  };
  std::vector<Vertex> vertices;
  std::vector<std::uint32_t> indices;
  std::vector<Piece> pieces;
};

AvatarMeshes avatarMeshes(const scene::Snapshot& snapshot, scene::EntityId hidden);

/// Linear RGB; neighbours in number differ most.
Eigen::Vector3f avatarColour(scene::EntityId id);

/// The pieces given, in this order.
DrawList drawList(const AvatarMeshes& avatars, const Camera& camera,
                  const std::vector<std::uint32_t>& pieces);

}  // namespace enfilade::render
