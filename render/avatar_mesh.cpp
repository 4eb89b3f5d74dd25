#include "render/avatar_mesh.hpp"

#include <algorithm>
#include <array>
#include <cmath>

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

AvatarMeshes::Piece beginPiece(const AvatarMeshes& meshes, const scene::AvatarView& avatar,
                               const Eigen::Vector3f& colour, float glow) {
  scene::Material material;
  material.baseColour.head<3>() = colour;
  material.emissive = glow * colour;
  material.roughness = 0.6f;
  MeshRange range;
  range.firstIndex = static_cast<std::uint32_t>(meshes.indices.size());
  range.baseVertex = static_cast<std::int32_t>(meshes.vertices.size());
  return {range, avatar.feet, {}, materialData(material), avatar.id};
}

void endPiece(AvatarMeshes& meshes, AvatarMeshes::Piece piece) {
  piece.range.indexCount =
      static_cast<std::uint32_t>(meshes.indices.size()) - piece.range.firstIndex;
  for (auto v = static_cast<std::size_t>(piece.range.baseVertex); v < meshes.vertices.size(); ++v) {
    const float* p = meshes.vertices[v].position;
    piece.box.include(piece.feet + Vec3(p[0], p[1], p[2]));
  }
  if (piece.range.indexCount > 0) meshes.pieces.push_back(piece);
}

void addBody(AvatarMeshes& meshes, const scene::AvatarView& avatar) {
  const AvatarMeshes::Piece piece = beginPiece(meshes, avatar, avatarColour(avatar.id), 0.10f);
  for (const scene::AvatarPart& part : avatar.shape->parts) {
    for (const auto& face : part.hull->faces) {
      std::vector<Vec3> corners;
      for (const std::uint32_t vertex : face)
        corners.push_back(part.rotation * part.hull->vertices[vertex] + part.offset);
      addPolygon(meshes, piece.range, corners);
    }
  }
  endPiece(meshes, piece);
}

/// A pale wedge at the height of the eyes: its tip points where the avatar looks.
void addVisor(AvatarMeshes& meshes, const scene::AvatarView& avatar) {
  double reach = 0;  // metres from the axis to the rim of the hull
  for (const Vec3& v : avatar.shape->parts.front().hull->vertices)
    reach = std::max(reach, std::hypot(v.x(), v.z()));
  Vec3 ahead(avatar.gaze.x(), 0, avatar.gaze.z());
  ahead = ahead.norm() > 1e-6 ? ahead.normalized() : Vec3(Vec3::UnitX());
  const Vec3 aside = ahead.cross(Vec3::UnitY());
  const Vec3 eyes(0, avatar.eyeHeight, 0);
  const double half = 0.35 * reach;  // of the wedge's height
  const double lift = std::clamp(avatar.gaze.y(), -0.7, 0.7) * reach;
  const Vec3 tip = eyes + 1.6 * reach * ahead + Vec3(0, lift, 0);
  const Vec3 root = eyes + 0.5 * reach * ahead;
  const Vec3 thick(0, half, 0);
  const std::array<Vec3, 4> base{
      root - 0.8 * reach * aside - thick, root + 0.8 * reach * aside - thick,
      root + 0.8 * reach * aside + thick, root - 0.8 * reach * aside + thick};
  const AvatarMeshes::Piece piece =
      beginPiece(meshes, avatar, Eigen::Vector3f(0.9f, 0.88f, 0.8f), 0.15f);
  for (std::size_t i = 0; i < base.size(); ++i) {
    addPolygon(meshes, piece.range, {base[i], base[(i + 1) % base.size()], tip});
  }
  addPolygon(meshes, piece.range, {base[3], base[2], base[1], base[0]});
  endPiece(meshes, piece);
}

}  // namespace

Eigen::Vector3f avatarColour(scene::EntityId id) {
  static const std::array<Eigen::Vector3f, 8> kColours{
      Eigen::Vector3f{0.85f, 0.16f, 0.06f}, Eigen::Vector3f{0.04f, 0.30f, 0.75f},
      Eigen::Vector3f{0.90f, 0.55f, 0.03f}, Eigen::Vector3f{0.06f, 0.50f, 0.16f},
      Eigen::Vector3f{0.50f, 0.10f, 0.55f}, Eigen::Vector3f{0.02f, 0.55f, 0.55f},
      Eigen::Vector3f{0.80f, 0.12f, 0.35f}, Eigen::Vector3f{0.45f, 0.50f, 0.04f}};
  return kColours[id % kColours.size()];
}

AvatarMeshes avatarMeshes(const scene::Snapshot& snapshot, scene::EntityId hidden) {
  AvatarMeshes meshes;
  for (const scene::AvatarView& avatar : snapshot.avatars) {
    if (avatar.id == hidden || !avatar.shape) continue;
    addBody(meshes, avatar);
    addVisor(meshes, avatar);
  }
  return meshes;
}

DrawList drawList(const AvatarMeshes& avatars, const Camera& camera,
                  const std::vector<std::uint32_t>& pieces) {
  DrawList list;
  if (!pieces.empty()) list.batches.push_back({});
  for (const std::uint32_t index : pieces) {
    const AvatarMeshes::Piece& piece = avatars.pieces[index];
    Eigen::Affine3d worldFromBody = Eigen::Affine3d::Identity();
    worldFromBody.translation() = piece.feet;
    const auto instance = static_cast<std::uint32_t>(list.instances.size());
    list.instances.push_back(
        placed(worldFromBody, Vec3::Zero(), camera.eye, piece.material, piece.id));
    list.commands.push_back(
        {piece.range.indexCount, 1, piece.range.firstIndex, piece.range.baseVertex, instance});
    ++list.batches.back().commandCount;
  }
  return list;
}

}  // namespace enfilade::render
