// The ray tracing trees of a snapshot: static items, bodies and avatars, opaque and transparent
// surfaces separately. Trees are built on demand.
#pragma once

#include <list>
#include <memory>
#include <optional>
#include <vector>

#include "render/avatar_mesh.hpp"
#include "render/raytrace/ray_tree.hpp"

namespace enfilade::render {

/// The traceable scene, as of the last update().
class RayScene {
 public:
  RayScene(std::shared_ptr<const scene::Scene> scene, bool robust, scene::EmbreeFilter maskFilter);

  /// Moves bodies and avatars to their poses in `snapshot`.
  void update(const scene::Snapshot& snapshot, AvatarForm form);

  /// Non-empty trees, built on the first call. Pointers are valid until the next update(). An
  /// avatar that is hidden may still be in them.
  std::vector<const RayTree*> opaqueTrees(scene::EntityId hiddenEntity = 0);
  std::vector<const RayTree*> transparentTrees() { return itemTrees(true); }

  /// Origin of the trees, world, metres. Rays must be relative to it, to reduce float rounding.
  const Vec3& origin() const { return origin_; }
  const scene::Model& model() const { return scene_->model(); }

 private:
  std::vector<const RayTree*> itemTrees(bool isTransparent);
  /// The batches of dynamic or static, transparent or opaque items.
  std::vector<TriangleBatch> collectBatches(bool isDynamic, bool transparent) const;
  std::optional<RayTree> buildTree(std::vector<TriangleBatch> batches);  ///< nullopt: no batches
  void updateBodies(const scene::Snapshot& snapshot);
  void updateAvatars(const scene::Snapshot& snapshot, AvatarForm form);
  void buildAvatarTree();
  void chooseInstancing();

  std::shared_ptr<const scene::Scene> scene_;
  scene::EmbreeFilter maskFilter_;
  Vec3 origin_ = Vec3::Zero();
  scene::MeshTrees meshes_;
  std::vector<DrawItem> items_;
  std::vector<MaterialData> materials_;  ///< one per mesh
  std::vector<bool> instanced_;          ///< one per item

  std::vector<scene::AvatarSnapshot> currentAvatars_;
  AvatarForm avatarForm_ = AvatarForm::figure;
  std::vector<scene::Mesh> avatarMeshes_;  ///< empty for figures
  std::vector<Eigen::Affine3d> worldFromAvatars_;
  std::vector<MaterialData> avatarMaterials_;

  struct LazyTree {
    bool built = false;
    std::optional<RayTree> tree;  ///< nullopt: no such items
  };
  LazyTree staticTrees_[2];  ///< opaque, transparent
  /// Bodies at one set of places, and their trees. Worlds of one scene take turns in the renderer,
  /// so several are kept.
  struct BodyState {
    std::shared_ptr<const std::vector<scene::BodySnapshot>>
        snapshot;  ///< the last with these places
    std::vector<BodyPlacement> placements;
    std::vector<Eigen::Affine3d> worldFromItem;  ///< by number in bodyItems_
    LazyTree trees[2];                           ///< opaque, transparent
  };
  std::list<BodyState> bodyStates_;     ///< the current one first, then by last use
  std::vector<std::size_t> bodyItems_;  ///< indices into items_, of bodies; empty: there are none
  LazyTree avatarTree_;
};

}  // namespace enfilade::render
