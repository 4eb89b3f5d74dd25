// DrawItem: one drawn mesh of one object. Pictures and rays share one list of draw items.
#pragma once

#include <cstdint>
#include <vector>

#include "scene/model/coplanar_surfaces.hpp"
#include "scene/model/model.hpp"

namespace enfilade::scene {

/// One mesh of one object.
struct DrawItem {
  static constexpr std::uint32_t kStatic = 0xFFFF'FFFFu;  ///< value of `body`

  Aabb box;  ///< world, as authored
  std::uint32_t object = 0, mesh = 0;
  std::int32_t texture = -1;  ///< index into Model::textures; -1: none
  Material::Alpha alphaMode = Material::Alpha::opaque;
  bool coloured = false;          ///< the mesh has vertex colours
  std::uint8_t coplanarRank = 0;  ///< of surfaces in one plane the lowest is visible
  std::uint32_t body = kStatic;   ///< index into Model::bodies

  bool isStatic() const { return body == kStatic; }
};

/// All items of the model except triggers and collision-only objects, in drawing order: by alpha
/// mode, texture, vertex colours, descending coplanar rank, object. The order never depends on the
/// camera, so that depth ties are resolved equally in every frame.
/// `ranks`: as rankCoplanarObjects() returns them.
std::vector<DrawItem> buildDrawItems(const Model& model, const std::vector<CoplanarRank>& ranks);

/// A box around the transformed box.
Aabb transformAabb(const Eigen::Affine3d& worldFromMesh, const Aabb& box);

}  // namespace enfilade::scene
