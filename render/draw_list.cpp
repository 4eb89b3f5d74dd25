#include "render/draw_list.hpp"

#include <algorithm>
#include <tuple>
#include <utility>

namespace enfilade::render {
namespace {

/// A mesh may come without a material of its own (hand-made models do).
const scene::Material& materialOf(const scene::Model& model, std::uint32_t index) {
  static const scene::Material plain;
  return index < model.materials.size() ? model.materials[index] : plain;
}

std::int32_t textureOf(const scene::Model& model, const scene::Material& material) {
  const auto index = material.baseColourTexture;
  return index >= 0 && static_cast<std::size_t>(index) < model.textures.size() ? index : -1;
}

Pass passOf(const scene::Material& material) {
  switch (material.alpha) {
    case scene::Material::Alpha::mask:
      return Pass::mask;
    case scene::Material::Alpha::blend:
      return Pass::blend;
    case scene::Material::Alpha::opaque:
      break;
  }
  return Pass::opaque;
}

scene::Box boxOf(const scene::Mesh& mesh) {
  scene::Box box;
  for (const Eigen::Vector3f& position : mesh.positions) box.include(position.cast<double>());
  return box;
}

scene::Box placedBox(const Eigen::Affine3d& worldFromMesh, const scene::Box& box) {
  const Vec3 centre = worldFromMesh * box.centre();
  const Vec3 half = worldFromMesh.linear().cwiseAbs() * (0.5 * box.size());
  return {centre - half, centre + half};
}

/// Farthest first; equal distances keep their order.
void sortBackToFront(std::vector<std::uint32_t>& glass, const std::vector<Part>& parts,
                     const std::vector<BodyPlacement>& bodies, const Camera& camera) {
  const bool perspective = camera.projection == Camera::Projection::perspective;
  const Vec3 forward = viewOf(camera).forward;
  std::vector<std::pair<double, std::uint32_t>> sorted;
  sorted.reserve(glass.size());
  for (const std::uint32_t part : glass) {
    const Vec3 toPart = placedBox(parts[part], bodies).centre() - camera.eye;
    sorted.emplace_back(perspective ? toPart.squaredNorm() : forward.dot(toPart), part);
  }
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  std::transform(sorted.begin(), sorted.end(), glass.begin(),
                 [](const auto& entry) { return entry.second; });
}

void append(DrawList& list, const Part& part, Pass pass, const MeshRange& range, bool singly) {
  const auto instance = static_cast<std::uint32_t>(list.instances.size() - 1);
  const bool sameBatch = !list.batches.empty() && list.batches.back().pass == pass &&
                         list.batches.back().texture == part.texture;
  if (!sameBatch) {
    list.batches.push_back(
        {pass, part.texture, static_cast<std::uint32_t>(list.commands.size()), 0});
  }
  Batch& batch = list.batches.back();
  // Neighbours in the order that share a mesh become one instanced draw.
  if (!singly && batch.commandCount > 0 && list.commands.back().firstIndex == range.firstIndex &&
      list.commands.back().count == range.indexCount) {
    ++list.commands.back().instanceCount;
    return;
  }
  list.commands.push_back({range.indexCount, 1, range.firstIndex, range.baseVertex, instance});
  ++batch.commandCount;
}

/// Of each object, the body that it belongs to, or kStill.
std::vector<std::uint32_t> bodiesOfObjects(const scene::Model& model) {
  std::vector<std::uint32_t> bodies(model.objects.size(), kStill);
  for (std::uint32_t b = 0; b < model.bodies.size(); ++b)
    for (const std::uint32_t object : model.bodies[b].objects) bodies[object] = b;
  return bodies;
}

}  // namespace

std::vector<BodyPlacement> placementsOf(const scene::Scene& scene,
                                        const scene::Snapshot& snapshot) {
  std::vector<BodyPlacement> placements(scene.model().bodies.size());
  if (!snapshot.bodies) return placements;
  for (const scene::BodyView& view : *snapshot.bodies) {
    if (!view.displaced) continue;
    BodyPlacement& placement = placements[view.index];
    placement.displaced = true;
    placement.sceneFromAuthored = Eigen::Translation3d(view.pose.translation) * view.pose.rotation *
                                  Eigen::Translation3d(-scene.shapeOfBody(view.index)->origin);
  }
  return placements;
}

MaterialData materialData(const scene::Model& model, const scene::Mesh& mesh) {
  return materialData(materialOf(model, mesh.material));
}

MaterialData materialData(const scene::Material& material) {
  MaterialData data{};
  for (int i = 0; i < 4; ++i) data.baseColour[i] = material.baseColour[i];
  for (int i = 0; i < 3; ++i) data.emissive[i] = material.emissive[i];
  data.surface[0] = material.alphaCutoff;
  data.surface[1] = material.metallic;
  data.surface[2] = material.roughness;
  data.surface[3] = material.doubleSided ? 1.0f : 0.0f;
  return data;
}

std::vector<Part> partsOf(const scene::Model& model) {
  std::vector<scene::Box> meshBoxes;
  meshBoxes.reserve(model.meshes.size());
  for (const scene::Mesh& mesh : model.meshes) meshBoxes.push_back(boxOf(mesh));

  const std::vector<std::uint32_t> bodyOf = bodiesOfObjects(model);
  std::vector<Part> parts;
  for (std::uint32_t o = 0; o < model.objects.size(); ++o) {
    const scene::Object& object = model.objects[o];
    const std::uint32_t body = bodyOf[o];
    if (body != kStill && model.bodies[body].kind == scene::BodyKind::trigger) continue;
    if (object.use == scene::Object::Use::solid) continue;
    for (const std::uint32_t m : object.meshes) {
      if (model.meshes[m].indices.empty()) continue;
      const std::uint32_t materialIndex = model.meshes[m].material;
      const scene::Material& material = materialOf(model, materialIndex);
      parts.push_back({placedBox(object.worldFromMesh, meshBoxes[m]), o, m,
                       textureOf(model, material), passOf(material), body});
    }
  }
  const auto key = [](const Part& part) {
    // Glass is sorted again in every picture; until then only its object counts.
    return std::tuple(part.pass, part.pass == Pass::blend ? -1 : part.texture);
  };
  std::stable_sort(parts.begin(), parts.end(),
                   [&](const Part& a, const Part& b) { return key(a) < key(b); });
  return parts;
}

Instance placed(const Eigen::Affine3d& worldFromMesh, const Vec3& meshCentre, const Vec3& eye,
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

scene::Box placedBox(const Part& part, const std::vector<BodyPlacement>& bodies) {
  if (part.body == kStill || !bodies[part.body].displaced) return part.box;
  return placedBox(bodies[part.body].sceneFromAuthored, part.box);
}

std::vector<std::uint32_t> partsInPicture(const std::vector<Part>& parts,
                                          const std::vector<BodyPlacement>& bodies,
                                          const Camera& camera, scene::EntityId hidden) {
  const auto frustum = frustumOf(camera);
  std::vector<std::uint32_t> inside;
  for (std::uint32_t i = 0; i < parts.size(); ++i) {
    if (parts[i].object + 1 == hidden) continue;
    if (mayBeSeen(frustum, placedBox(parts[i], bodies))) inside.push_back(i);
  }
  return inside;
}

DrawLists drawLists(const Drawable& drawable, const std::vector<BodyPlacement>& bodies,
                    const Camera& camera, const FrameOptions& options,
                    const std::vector<std::uint32_t>& parts) {
  const bool solid = options.glass == Glass::solid;
  const auto draw = [&](DrawList& list, const Part& part) {
    const MeshRange& range = drawable.ranges[part.mesh];
    Eigen::Affine3d worldFromMesh = drawable.model.objects[part.object].worldFromMesh;
    if (part.body != kStill && bodies[part.body].displaced)
      worldFromMesh = bodies[part.body].sceneFromAuthored * worldFromMesh;
    list.instances.push_back(placed(worldFromMesh, range.centre, camera.eye,
                                    drawable.materials[part.mesh], part.object + 1));
    append(list, part, solid && part.pass == Pass::blend ? Pass::opaque : part.pass, range,
           list.singly);
  };
  DrawLists lists;
  lists.surfaces.singly = lists.glass.singly = options.culling == Culling::singly;
  std::vector<std::uint32_t> glass;
  for (const std::uint32_t index : parts) {
    const Part& part = drawable.parts[index];
    if (part.pass == Pass::blend && !solid) {
      glass.push_back(index);
    } else {
      draw(lists.surfaces, part);
    }
  }
  sortBackToFront(glass, drawable.parts, bodies, camera);
  for (const std::uint32_t index : glass) draw(lists.glass, drawable.parts[index]);
  return lists;
}

}  // namespace enfilade::render
