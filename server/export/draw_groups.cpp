#include "server/export/draw_groups.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>
#include <utility>

#include "collision/assert.hpp"

namespace enfilade::server {
namespace {

/// Cosine between two axes of a transform below which it counts as free of shear. Rotations that a
/// file stores in single precision deviate by about 1e-7.
constexpr double kMaxShear = 5e-7;

auto makeAppearanceKey(const scene::Material& material,
                       const std::vector<std::uint32_t>& equalTextures) {
  const std::int32_t texture = material.baseColourTexture;
  const bool isTextured = texture >= 0 && static_cast<std::size_t>(texture) < equalTextures.size();
  const auto& c = material.baseColour;
  const auto& e = material.emissive;
  return std::make_tuple(c.x(), c.y(), c.z(), c.w(), e.x(), e.y(), e.z(), material.metallic,
                         material.roughness, material.alpha, material.alphaCutoff,
                         material.doubleSided,
                         isTextured ? equalTextures[static_cast<std::size_t>(texture)] : ~0u);
}

std::vector<std::uint32_t> collectMeshesWithTriangles(const scene::Model& model,
                                                      const scene::Object& object) {
  std::vector<std::uint32_t> meshes;
  for (const std::uint32_t mesh : object.meshes)
    if (model.meshes[mesh].triangleCount() > 0) meshes.push_back(mesh);
  return meshes;
}

/// Vertices that instancing saves, against merged copies.
std::size_t countSavedVertices(const scene::Model& model, const InstanceGroup& group) {
  std::size_t vertices = 0;
  for (const std::uint32_t mesh : group.meshes) vertices += model.meshes[mesh].positions.size();
  return vertices * (group.objects.size() - 1);
}

/// Static, drawn objects that share their meshes and have a transform that instances can have.
std::vector<InstanceGroup> findCandidates(const scene::Model& model,
                                          const std::vector<bool>& isStatic) {
  std::map<std::vector<std::uint32_t>, InstanceGroup> byMeshes;
  for (std::uint32_t i = 0; i < model.objects.size(); ++i) {
    if (!isStatic[i]) continue;
    const std::vector<std::uint32_t> meshes = collectMeshesWithTriangles(model, model.objects[i]);
    const auto transform = decomposeTrs(model.objects[i].worldFromMesh);
    if (meshes.empty() || !transform) continue;
    InstanceGroup& group = byMeshes[meshes];
    group.meshes = meshes;
    group.objects.push_back(i);
    group.transforms.push_back(*transform);
  }
  std::vector<InstanceGroup> candidates;
  for (auto& [meshes, group] : byMeshes)
    if (group.objects.size() >= kMinInstances) candidates.push_back(std::move(group));
  return candidates;
}

std::vector<InstanceGroup> chooseInstanceGroups(const scene::Model& model,
                                                std::vector<InstanceGroup> candidates) {
  const auto byFirstObject = [](const InstanceGroup& a, const InstanceGroup& b) {
    return a.objects.front() < b.objects.front();
  };
  std::sort(candidates.begin(), candidates.end(), byFirstObject);
  std::stable_sort(candidates.begin(), candidates.end(),
                   [&](const InstanceGroup& a, const InstanceGroup& b) {
                     return countSavedVertices(model, a) > countSavedVertices(model, b);
                   });
  std::vector<InstanceGroup> chosen;
  std::size_t primitives = 0;
  for (InstanceGroup& group : candidates) {
    if (primitives + group.meshes.size() > kMaxInstancedPrimitives) continue;
    primitives += group.meshes.size();
    chosen.push_back(std::move(group));
  }
  std::sort(chosen.begin(), chosen.end(), byFirstObject);
  return chosen;
}

std::vector<MeshBatch> makeBatches(const scene::Model& model, const std::vector<bool>& isMerged) {
  const std::vector<std::uint32_t> equalMaterials = findEqualMaterials(model);
  std::map<std::tuple<std::uint32_t, bool, bool>, MeshBatch> batches;
  for (std::uint32_t i = 0; i < model.objects.size(); ++i) {
    if (!isMerged[i]) continue;
    for (const std::uint32_t index : collectMeshesWithTriangles(model, model.objects[i])) {
      const scene::Mesh& mesh = model.meshes[index];
      const std::uint32_t material = findMaterial(mesh, equalMaterials);
      const bool hasNormals = mesh.normals.size() == mesh.positions.size();
      const bool hasColours = !mesh.colours.empty();
      MeshBatch& batch = batches[{material, hasNormals, hasColours}];
      batch.material = material;
      batch.hasNormals = hasNormals;
      batch.hasColours = hasColours;
      batch.uses.push_back({i, index});
    }
  }
  std::vector<MeshBatch> ordered;
  for (auto& [key, batch] : batches) ordered.push_back(std::move(batch));
  return ordered;
}

}  // namespace

std::optional<TrsTransform> decomposeTrs(const Eigen::Affine3d& transform) {
  const collision::Mat3 linear = transform.linear();
  const scene::Vec3 scale = linear.colwise().norm().transpose();
  if (!(scale.minCoeff() > 0) || !(linear.determinant() > 0)) return std::nullopt;
  collision::Mat3 axes;
  for (int i = 0; i < 3; ++i) axes.col(i) = linear.col(i) / scale[i];
  const double shear =
      std::max({std::abs(axes.col(0).dot(axes.col(1))), std::abs(axes.col(1).dot(axes.col(2))),
                std::abs(axes.col(2).dot(axes.col(0)))});
  if (!(shear <= kMaxShear)) return std::nullopt;
  return TrsTransform{transform.translation(), Eigen::Quaterniond(axes).normalized(), scale};
}

std::vector<std::uint32_t> findEqualTextures(const scene::Model& model) {
  std::vector<std::uint32_t> equal;
  for (std::uint32_t i = 0; i < model.textures.size(); ++i) {
    const scene::Texture& texture = model.textures[i];
    equal.push_back(i);
    for (std::uint32_t earlier = 0; earlier < i && equal[i] == i; ++earlier) {
      const scene::Texture& other = model.textures[earlier];
      if (equal[earlier] == earlier && other.width == texture.width && other.rgba == texture.rgba)
        equal[i] = earlier;
    }
  }
  return equal;
}

std::vector<std::uint32_t> findEqualMaterials(const scene::Model& model) {
  const scene::Material none;
  const std::vector<std::uint32_t> equalTextures = findEqualTextures(model);
  std::map<decltype(makeAppearanceKey(none, equalTextures)), std::uint32_t> first;
  std::vector<std::uint32_t> equal;
  for (std::uint32_t i = 0; i <= model.materials.size(); ++i) {
    const scene::Material& material = i < model.materials.size() ? model.materials[i] : none;
    equal.push_back(first.try_emplace(makeAppearanceKey(material, equalTextures), i).first->second);
  }
  return equal;
}

std::uint32_t findMaterial(const scene::Mesh& mesh,
                           const std::vector<std::uint32_t>& equalMaterials) {
  return equalMaterials[std::min<std::size_t>(mesh.material, equalMaterials.size() - 1)];
}

std::vector<bool> findDrawnObjects(const scene::Model& model) {
  std::vector<bool> drawn(model.objects.size());
  for (std::size_t i = 0; i < drawn.size(); ++i)
    drawn[i] = model.objects[i].usage != scene::Object::Usage::collisionOnly;
  for (const scene::BodySpec& body : model.bodies)
    if (isTrigger(body.kind))
      for (const std::uint32_t object : body.objects) drawn[object] = false;
  return drawn;
}

DrawGroups makeDrawGroups(const scene::Model& model) {
  DrawGroups groups;
  std::vector<bool> isMerged = findDrawnObjects(model);
  for (std::uint32_t i = 0; i < model.bodies.size(); ++i) {
    if (!isTrigger(model.bodies[i].kind)) groups.bodies.push_back(i);
    for (const std::uint32_t object : model.bodies[i].objects) isMerged[object] = false;
  }
  groups.instanced = chooseInstanceGroups(model, findCandidates(model, isMerged));
  for (const InstanceGroup& group : groups.instanced) {
    ENFILADE_ASSERT(!group.meshes.empty() && group.transforms.size() == group.objects.size() &&
                    std::ranges::is_sorted(group.objects));
    for (const std::uint32_t object : group.objects) isMerged[object] = false;
  }
  groups.batches = makeBatches(model, isMerged);
  return groups;
}

}  // namespace enfilade::server
