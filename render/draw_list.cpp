#include "render/draw_list.hpp"

#include <algorithm>
#include <span>
#include <utility>

#include "collision/assert.hpp"

namespace enfilade::render {
namespace {

/// Farthest first; equal distances keep their order.
void sortBackToFront(std::vector<std::uint32_t>& transparent, std::span<const DrawItem> items,
                     const std::vector<BodyPlacement>& bodies, const Camera& camera) {
  const bool perspective = camera.projection == Camera::Projection::perspective;
  const Vec3 forward = computeCameraBasis(camera).forward;
  std::vector<std::pair<double, std::uint32_t>> sorted;
  sorted.reserve(transparent.size());
  for (const std::uint32_t item : transparent) {
    const Vec3 toItem = computeItemAabb(items[item], bodies).centre() - camera.eye;
    sorted.emplace_back(perspective ? toItem.squaredNorm() : forward.dot(toItem), item);
  }
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  std::transform(sorted.begin(), sorted.end(), transparent.begin(),
                 [](const auto& entry) { return entry.second; });
}

void appendCommand(DrawList& list, const DrawItem& item, AlphaMode alphaMode,
                   const MeshRange& range, bool unbatched) {
  ENFILADE_ASSERT(!list.instances.empty());
  const auto instance = static_cast<std::uint32_t>(list.instances.size() - 1);
  const bool sameBatch = !list.batches.empty() && list.batches.back().alphaMode == alphaMode &&
                         list.batches.back().coloured == item.coloured &&
                         list.batches.back().texture == item.texture &&
                         list.batches.back().coplanarRank == item.coplanarRank;
  if (!sameBatch) {
    list.batches.push_back({alphaMode, item.coloured, item.texture, item.coplanarRank,
                            static_cast<std::uint32_t>(list.commands.size()), 0});
  }
  Batch& batch = list.batches.back();
  // Consecutive items with the same mesh become one instanced draw.
  if (!unbatched && batch.commandCount > 0 && list.commands.back().firstIndex == range.firstIndex &&
      list.commands.back().count == range.indexCount) {
    ++list.commands.back().instanceCount;
    return;
  }
  list.commands.push_back({range.indexCount, 1, range.firstIndex, range.baseVertex, instance});
  ++batch.commandCount;
}

}  // namespace

MaterialData makeMaterialData(const scene::Model& model, const scene::Mesh& mesh) {
  return makeMaterialData(findMaterial(model, mesh));
}

MaterialData makeMaterialData(const scene::Material& material) {
  MaterialData data{};
  for (int i = 0; i < 4; ++i) data.baseColour[i] = material.baseColour[i];
  for (int i = 0; i < 3; ++i) data.emissive[i] = material.emissive[i];
  data.surface[0] = material.alphaCutoff;
  data.surface[1] = material.metallic;
  data.surface[2] = material.roughness;
  data.surface[3] = material.doubleSided ? 1.0f : 0.0f;
  return data;
}

Instance makeInstance(const Eigen::Affine3d& worldFromMesh, const Vec3& meshCentre, const Vec3& eye,
                      const MaterialData& material, scene::EntityId id) {
  Instance instance{};
  const Vec3 origin = worldFromMesh * meshCentre - eye;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      instance.relativeFromMesh[4 * row + column] =
          static_cast<float>(worldFromMesh.linear()(row, column));
    }
    instance.relativeFromMesh[4 * row + 3] = static_cast<float>(origin[row]);
  }
  instance.material = material;
  instance.material.emissive[3] = worldFromMesh.linear().determinant() < 0 ? 1.0f : 0.0f;
  instance.id = id;
  return instance;
}

scene::Aabb computeItemAabb(const DrawItem& item, const std::vector<BodyPlacement>& bodies) {
  ENFILADE_ASSERT(item.isStatic() || item.body < bodies.size());
  if (item.isStatic() || !bodies[item.body].displaced) return item.box;
  return scene::transformAabb(bodies[item.body].sceneFromAuthored, item.box);
}

DrawLists buildDrawLists(const Drawable& drawable, const std::vector<BodyPlacement>& bodies,
                         const Camera& camera, const FrameOptions& options,
                         const std::vector<std::uint32_t>& items) {
  ENFILADE_ASSERT(std::is_sorted(items.begin(), items.end()));
  ENFILADE_ASSERT(drawable.ranges.size() == drawable.model.meshes.size());
  ENFILADE_ASSERT(drawable.materials.size() == drawable.model.meshes.size());
  const bool drawAsOpaque = options.transparency == TransparencyMode::opaque;
  const auto draw = [&](DrawList& list, const DrawItem& item) {
    const MeshRange& range = drawable.ranges[item.mesh];
    Eigen::Affine3d worldFromMesh = drawable.model.objects[item.object].worldFromMesh;
    if (!item.isStatic() && bodies[item.body].displaced)
      worldFromMesh = bodies[item.body].sceneFromAuthored * worldFromMesh;
    list.instances.push_back(makeInstance(worldFromMesh, range.centre, camera.eye,
                                          drawable.materials[item.mesh], item.object + 1));
    appendCommand(
        list, item,
        drawAsOpaque && item.alphaMode == AlphaMode::blend ? AlphaMode::opaque : item.alphaMode,
        range, list.unbatched);
  };
  DrawLists lists;
  lists.surfaces.unbatched = lists.transparent.unbatched = options.culling == Culling::none;
  std::vector<std::uint32_t> transparent;
  for (const std::uint32_t index : items) {
    const DrawItem& item = drawable.items[index];
    if (item.alphaMode == AlphaMode::blend && !drawAsOpaque) {
      transparent.push_back(index);
    } else {
      draw(lists.surfaces, item);
    }
  }
  sortBackToFront(transparent, drawable.items, bodies, camera);
  for (const std::uint32_t index : transparent) draw(lists.transparent, drawable.items[index]);
  return lists;
}

}  // namespace enfilade::render
