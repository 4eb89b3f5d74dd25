// Scenes that both renderers are tested with.
#pragma once

#include <random>
#include <set>
#include <vector>

#include "tests/render/hand_made_scene.hpp"

namespace enfilade::render {

/// Boxes within 10 m of the origin; some mirrored, some transparent.
inline std::vector<PlacedBox> makeCrowd(int count) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> place(-10, 10);
  std::uniform_real_distribution<double> length(0.3, 2);
  std::vector<PlacedBox> boxes;
  for (int i = 0; i < count; ++i) {
    PlacedBox box;
    for (int axis = 0; axis < 3; ++axis) box.centre[axis] = place(random);
    for (int axis = 0; axis < 3; ++axis) box.size[axis] = length(random);
    if (i % 3 == 0) box.size.x() = -box.size.x();
    const float shade = 0.1f * static_cast<float>(i % 9 + 1);
    box.material = makeColoured(shade, 1 - shade, 0.5f, i % 7 == 0 ? 0.4f : 1.0f);
    boxes.push_back(box);
  }
  return boxes;
}

inline std::set<std::uint32_t> findIdsIn(const Frame& frame) {
  return {frame.ids.begin(), frame.ids.end()};
}

inline std::vector<PlacedBox> makeOpaque(std::vector<PlacedBox> boxes) {
  for (PlacedBox& box : boxes) box.material.alpha = scene::Material::Alpha::opaque;
  return boxes;
}

/// An avatar: a prism 0.6 m wide and 1.75 m high.
inline scene::AvatarSnapshot makeAvatarAt(scene::EntityId id, const Vec3& footPosition) {
  std::vector<Vec3> points;
  for (const double y : {0.0, 1.75}) {
    for (const double x : {-0.3, 0.3}) {
      for (const double z : {-0.3, 0.3}) points.emplace_back(x, y, z);
    }
  }
  scene::AvatarSnapshot avatar;
  avatar.id = id;
  avatar.footPosition = footPosition;
  avatar.shape = scene::makeAvatarShape({scene::makeAvatarPart(
      std::make_shared<const collision::Hull>(collision::buildHull(points)))});
  return avatar;
}

/// A square two metres ahead of makeSquareCamera(); its left half is opaque, its right half cut
/// out.
inline std::shared_ptr<const scene::Scene> makeMaskedSquare() {
  scene::Model model;
  scene::Material leaf;
  leaf.alpha = scene::Material::Alpha::mask;
  leaf.baseColourTexture = 0;
  model.materials = {leaf};
  model.textures = {{"half", 2, 1, {255, 255, 255, 255, 255, 255, 255, 0}}};
  scene::Mesh square;
  square.positions = {{-1, -1, -2}, {1, -1, -2}, {1, 1, -2}, {-1, 1, -2}};
  square.uvs = {{0.25f, 0}, {0.75f, 0}, {0.75f, 1}, {0.25f, 1}};
  square.indices = {0, 1, 2, 0, 2, 3};
  model.meshes = {square};
  model.objects.resize(1);
  model.objects[0].meshes = {0};
  return std::make_shared<const scene::Scene>(std::move(model));
}

/// A floor with a repeated chequered texture, in front of makeSquareCamera(), and a mirrored box.
inline std::shared_ptr<const scene::Scene> makeTexturedRoom() {
  scene::Model model;
  scene::Material tiles;
  tiles.baseColourTexture = 0;
  model.materials = {tiles, makeColoured(0.7f, 0.3f, 0.2f)};
  scene::Texture chequers{"chequers", 16, 8, {}};
  for (std::uint32_t i = 0; i < 16 * 8; ++i) {
    const bool dark = (i / 4 + i / 32) % 2 == 0;
    const std::uint8_t shade = dark ? 60 : 220;
    for (const std::uint8_t c : {shade, std::uint8_t{128}, shade, std::uint8_t{255}})
      chequers.rgba.push_back(c);
  }
  model.textures = {chequers};
  scene::Mesh floor;
  floor.positions = {{-6, -1, 0}, {6, -1, 0}, {6, -1, -20}, {-6, -1, -20}};
  floor.uvs = {{0, 0}, {6, 0}, {6, 10}, {0, 10}};
  floor.normals.assign(4, Eigen::Vector3f::UnitY());
  floor.indices = {0, 1, 2, 0, 2, 3};
  scene::Mesh cube = makeUnitCube();
  cube.material = 1;
  model.meshes = {floor, cube};
  model.objects.resize(2);
  model.objects[0].path = "floor";
  model.objects[0].meshes = {0};
  model.objects[1].path = "box";
  model.objects[1].meshes = {1};
  model.objects[1].worldFromMesh =
      Eigen::Translation3d(0.5, 0, -3) * Eigen::Scaling(-2.0, 1.0, 2.0);
  return std::make_shared<const scene::Scene>(std::move(model));
}

/// A wall (object 1) and in front of it a cube of one metre (object 2), which is a lift.
inline std::shared_ptr<const scene::Scene> makeSceneWithLift() {
  scene::Model model = makeScene({{{0, 0, -8}, {40, 40, 1}, {}},
                                  {{0, 0, -5}, {1, 1, 1}, makeColoured(0.9f, 0.2f, 0.1f)}})
                           ->model();
  scene::BodySpec lift;
  lift.name = "lift";
  lift.kind = scene::BodyKind::lift;
  lift.objects = {1};
  lift.anchor = {0, 0, -5};
  lift.high = 3;
  lift.stops = {0, 3};
  model.bodies = {lift};
  return std::make_shared<const scene::Scene>(std::move(model));
}

inline scene::Snapshot makeSnapshotOfLift(const scene::Scene& scene, double height) {
  scene::BodySnapshot lift;
  lift.id = 2;
  lift.displaced = height != 0;
  lift.pose.translation = scene.bodyShape(0)->origin + Vec3(0, height, 0);
  scene::Snapshot snapshot;
  snapshot.bodies = std::make_shared<const std::vector<scene::BodySnapshot>>(1, lift);
  return snapshot;
}

}  // namespace enfilade::render
