#include "render/avatar_mesh.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "collision/assert.hpp"

namespace enfilade::render {
namespace {

void addPolygon(AvatarMeshes& meshes, const MeshRange& range, const std::vector<Vec3>& corners) {
  const auto first = static_cast<std::uint32_t>(meshes.vertices.size() -
                                                static_cast<std::uint32_t>(range.baseVertex));
  for (const Vec3& corner : corners) {
    const Eigen::Vector3f p = corner.cast<float>();
    meshes.vertices.push_back({{p.x(), p.y(), p.z()}, 0u, {0, 0}});
  }
  const auto count = static_cast<std::uint32_t>(corners.size());
  for (std::uint32_t i = 2; i < count; ++i) {
    for (const std::uint32_t corner : {0u, i - 1, i}) meshes.indices.push_back(first + corner);
  }
}

scene::Material makeAvatarMaterial(const Eigen::Vector3f& colour, float glow) {
  scene::Material material;
  material.baseColour.head<3>() = colour;
  material.emissive = glow * colour;
  material.roughness = 0.6f;
  return material;
}

/// A range that begins at the end of the buffers.
MeshRange beginRange(const AvatarMeshes& meshes) {
  MeshRange range;
  range.firstIndex = static_cast<std::uint32_t>(meshes.indices.size());
  range.baseVertex = static_cast<std::int32_t>(meshes.vertices.size());
  return range;
}

AvatarMeshes::Item beginItem(const AvatarMeshes& meshes, const scene::AvatarSnapshot& avatar,
                             const Eigen::Vector3f& colour, float glow) {
  return {beginRange(meshes),
          nullptr,
          Eigen::Affine3d(Eigen::Translation3d(avatar.footPosition)),
          {},
          makeAvatarMaterial(colour, glow),
          avatar.id};
}

void endItem(AvatarMeshes& meshes, AvatarMeshes::Item item) {
  item.range.indexCount = static_cast<std::uint32_t>(meshes.indices.size()) - item.range.firstIndex;
  for (auto v = static_cast<std::size_t>(item.range.baseVertex); v < meshes.vertices.size(); ++v) {
    const float* p = meshes.vertices[v].position;
    item.box.include(item.worldFromMesh * Vec3(p[0], p[1], p[2]));
  }
  if (item.range.indexCount > 0) meshes.items.push_back(item);
}

void addBody(AvatarMeshes& meshes, const scene::AvatarSnapshot& avatar) {
  const AvatarMeshes::Item item = beginItem(meshes, avatar, getAvatarColour(avatar.id), 0.10f);
  for (const scene::AvatarPart& part : avatar.shape->parts) {
    for (const auto& face : part.hull->faces) {
      std::vector<Vec3> corners;
      for (const std::uint32_t vertex : face)
        corners.push_back(part.rotation * part.hull->vertices[vertex] + part.offset);
      addPolygon(meshes, item.range, corners);
    }
  }
  endItem(meshes, item);
}

/// A pale wedge at eye height whose tip points in the view direction.
void addVisor(AvatarMeshes& meshes, const scene::AvatarSnapshot& avatar) {
  ENFILADE_ASSERT(!avatar.shape->parts.empty());
  double radius = 0;  // metres from the axis to the rim of the hull
  for (const Vec3& v : avatar.shape->parts.front().hull->vertices)
    radius = std::max(radius, std::hypot(v.x(), v.z()));
  Vec3 ahead(avatar.viewDirection.x(), 0, avatar.viewDirection.z());
  ahead = ahead.norm() > 1e-6 ? ahead.normalized() : Vec3(Vec3::UnitX());
  const Vec3 aside = ahead.cross(Vec3::UnitY());
  const Vec3 eyes(0, avatar.eyeHeight, 0);
  const double half = 0.35 * radius;  // of the wedge's height
  const double lift = std::clamp(avatar.viewDirection.y(), -0.7, 0.7) * radius;
  const Vec3 tip = eyes + 1.6 * radius * ahead + Vec3(0, lift, 0);
  const Vec3 root = eyes + 0.5 * radius * ahead;
  const Vec3 thick(0, half, 0);
  const std::array<Vec3, 4> base{
      root - 0.8 * radius * aside - thick, root + 0.8 * radius * aside - thick,
      root + 0.8 * radius * aside + thick, root - 0.8 * radius * aside + thick};
  const AvatarMeshes::Item item =
      beginItem(meshes, avatar, Eigen::Vector3f(0.9f, 0.88f, 0.8f), 0.15f);
  for (std::size_t i = 0; i < base.size(); ++i) {
    addPolygon(meshes, item.range, {base[i], base[(i + 1) % base.size()], tip});
  }
  addPolygon(meshes, item.range, {base[3], base[2], base[1], base[0]});
  endItem(meshes, item);
}

/// The range of a figure's mesh, which is added for its first avatar.
MeshRange findOrAddRange(AvatarMeshes& meshes, const scene::Mesh& mesh) {
  const auto same = std::ranges::find(meshes.items, &mesh, &AvatarMeshes::Item::figure);
  if (same != meshes.items.end()) return same->range;
  MeshRange range = beginRange(meshes);
  range.indexCount = static_cast<std::uint32_t>(mesh.indices.size());
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    const Eigen::Vector3f& p = mesh.positions[v];
    meshes.vertices.push_back({{p.x(), p.y(), p.z()}, packNormal(mesh.normals[v]), {0, 0}});
  }
  meshes.indices.insert(meshes.indices.end(), mesh.indices.begin(), mesh.indices.end());
  return range;
}

void addFigure(AvatarMeshes& meshes, const scene::AvatarSnapshot& avatar) {
  const Figure figure = placeFigure(avatar);
  const double width = figure.worldFromMesh.linear().col(0).norm();
  AvatarMeshes::Item item{findOrAddRange(meshes, *figure.mesh),
                          figure.mesh,
                          figure.worldFromMesh,
                          {},
                          makeAvatarMaterial(getAvatarColour(avatar.id), 0.05f),
                          avatar.id};
  item.box.include(avatar.footPosition - Vec3(width, 0, width));
  item.box.include(avatar.footPosition + Vec3(width, avatar.height, width));
  meshes.items.push_back(item);
}

}  // namespace

Eigen::Vector3f getAvatarColour(scene::EntityId id) {
  // No red: it marks contacts.
  static const std::array<Eigen::Vector3f, 8> kColours{
      Eigen::Vector3f{0.10f, 0.08f, 0.40f}, Eigen::Vector3f{0.04f, 0.30f, 0.75f},
      Eigen::Vector3f{0.90f, 0.55f, 0.03f}, Eigen::Vector3f{0.06f, 0.50f, 0.16f},
      Eigen::Vector3f{0.50f, 0.10f, 0.55f}, Eigen::Vector3f{0.02f, 0.55f, 0.55f},
      Eigen::Vector3f{0.80f, 0.12f, 0.35f}, Eigen::Vector3f{0.45f, 0.50f, 0.04f}};
  return kColours[id % kColours.size()];
}

bool hasSameAppearance(const scene::AvatarSnapshot& a, const scene::AvatarSnapshot& b) {
  return a.id == b.id && a.shape == b.shape && a.footPosition == b.footPosition &&
         a.viewDirection == b.viewDirection && a.eyeHeight == b.eyeHeight && a.height == b.height &&
         a.spawnHeight == b.spawnHeight;
}

AvatarMeshes buildAvatarMeshes(const std::vector<scene::AvatarSnapshot>& avatars, AvatarForm form) {
  AvatarMeshes meshes;
  for (const scene::AvatarSnapshot& avatar : avatars) {
    if (!avatar.shape) continue;
    if (form == AvatarForm::figure && isPerson(avatar)) {
      addFigure(meshes, avatar);
    } else {
      addBody(meshes, avatar);
      addVisor(meshes, avatar);
    }
  }
  return meshes;
}

DrawList buildAvatarDrawList(const AvatarMeshes& avatars, const Camera& camera,
                             const std::vector<std::uint32_t>& items) {
  DrawList list;
  if (!items.empty()) list.batches.push_back({});
  for (const std::uint32_t index : items) {
    ENFILADE_ASSERT(index < avatars.items.size());
    const AvatarMeshes::Item& item = avatars.items[index];
    const auto instance = static_cast<std::uint32_t>(list.instances.size());
    list.instances.push_back(makeInstance(item.worldFromMesh, Vec3::Zero(), camera.eye,
                                          makeMaterialData(item.material), item.id));
    list.commands.push_back(
        {item.range.indexCount, 1, item.range.firstIndex, item.range.baseVertex, instance});
    ++list.batches.back().commandCount;
  }
  return list;
}

}  // namespace enfilade::render
