#include "scene/model/draw_items.hpp"

#include <algorithm>
#include <tuple>

namespace enfilade::scene {
namespace {

std::int32_t findTexture(const Model& model, const Material& material) {
  const auto index = material.baseColourTexture;
  return index >= 0 && static_cast<std::size_t>(index) < model.textures.size() ? index : -1;
}

Aabb computeMeshAabb(const Mesh& mesh) {
  Aabb box;
  for (const Eigen::Vector3f& position : mesh.positions) box.include(position.cast<double>());
  return box;
}

void sortInDrawingOrder(std::vector<DrawItem>& items) {
  const auto key = [](const DrawItem& item) {
    // Transparent items are sorted again in every frame; here only the object counts.
    const bool blend = item.alphaMode == Material::Alpha::blend;
    return std::tuple(item.alphaMode, blend ? -1 : item.texture, !blend && item.coloured,
                      blend ? 0 : -item.coplanarRank);
  };
  std::stable_sort(items.begin(), items.end(),
                   [&](const DrawItem& a, const DrawItem& b) { return key(a) < key(b); });
}

}  // namespace

std::vector<DrawItem> buildDrawItems(const Model& model, const std::vector<CoplanarRank>& ranks) {
  std::vector<Aabb> meshBoxes;
  meshBoxes.reserve(model.meshes.size());
  for (const Mesh& mesh : model.meshes) meshBoxes.push_back(computeMeshAabb(mesh));

  const std::vector<const BodySpec*> bodyOfObject = mapObjectsToBodies(model);
  std::vector<DrawItem> items;
  for (std::uint32_t o = 0; o < model.objects.size(); ++o) {
    const Object& object = model.objects[o];
    const BodySpec* body = bodyOfObject[o];
    if (body && isTrigger(body->kind)) continue;
    if (object.usage == Object::Usage::collisionOnly) continue;
    for (const std::uint32_t m : object.meshes) {
      const Mesh& mesh = model.meshes[m];
      if (mesh.triangleCount() == 0) continue;
      const Material& material = findMaterial(model, mesh);
      items.push_back(
          {transformAabb(object.worldFromMesh, meshBoxes[m]), o, m, findTexture(model, material),
           material.alpha, !mesh.colours.empty(), ranks[o].rank,
           body ? static_cast<std::uint32_t>(body - model.bodies.data()) : DrawItem::kStatic});
    }
  }
  sortInDrawingOrder(items);
  return items;
}

Aabb transformAabb(const Eigen::Affine3d& worldFromMesh, const Aabb& box) {
  const Vec3 centre = worldFromMesh * box.centre();
  const Vec3 half = worldFromMesh.linear().cwiseAbs() * (0.5 * box.size());
  return {centre - half, centre + half};
}

}  // namespace enfilade::scene
