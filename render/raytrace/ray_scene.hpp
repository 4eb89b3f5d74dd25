// The ray tracing trees of a snapshot: static items, bodies and avatars, opaque and transparent
// surfaces separately. Avatars have a tree of the renderer; the others are those of the scene.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "render/avatar_mesh.hpp"
#include "scene/world/queries/scene_trees.hpp"

namespace enfilade::render {

using scene::RayTree;
using scene::TriangleBatch;

/// The traceable scene, as of the last update().
class RayScene {
 public:
  explicit RayScene(std::shared_ptr<const scene::Scene> scene);

  /// Moves bodies and avatars to their poses in `snapshot`.
  void update(const scene::Snapshot& snapshot, AvatarForm form);

  /// Non-empty trees, built on the first call. Pointers are valid until the next update(). An
  /// avatar that is hidden may still be in them.
  std::vector<const RayTree*> opaqueTrees(scene::EntityId hiddenEntity = 0);
  std::vector<const RayTree*> transparentTrees() { return itemTrees(true); }

  /// Origin of the trees, world, metres. Rays must be relative to it, to reduce float rounding.
  const Vec3& origin() const { return trees_->origin(); }
  const scene::Model& model() const { return scene_->model(); }

 private:
  std::vector<const RayTree*> itemTrees(bool isTransparent);
  void updateAvatars(const scene::Snapshot& snapshot, AvatarForm form);
  void buildAvatarTree();

  std::shared_ptr<const scene::Scene> scene_;
  scene::SceneTrees* trees_ = nullptr;          ///< of the scene
  std::shared_ptr<scene::PlacedItems> bodies_;  ///< null: there are none

  std::vector<scene::AvatarSnapshot> currentAvatars_;
  AvatarForm avatarForm_ = AvatarForm::figure;
  AvatarMeshes avatars_;                   ///< to which the tree refers
  std::vector<scene::Mesh> avatarMeshes_;  ///< one per item; empty for figures
  bool avatarTreeBuilt_ = false;
  std::optional<RayTree> avatarTree_;  ///< nullopt: there are no avatars
};

}  // namespace enfilade::render
