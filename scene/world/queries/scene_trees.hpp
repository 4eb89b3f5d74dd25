// The Embree trees of a scene's drawn meshes, each built once, for rays of clients and of
// renderers.
//
// The static scene is copied into single trees, because instances would cost rays half as much
// again. Repeated meshes are instanced only in very large scenes. Bodies are instances. Opaque and
// transparent items have separate trees: pictures need the latter for colour alone, and rays may
// ignore them. Trees are built on demand, with one thread. All functions may be called from any
// thread: world threads answer rays while a renderer draws. One mutex guards this object; nothing
// changes a tree afterwards, so tracing needs no lock. Other threads may build trees of their own
// on device(): Embree's devices are thread-safe, and keep their errors per thread.
#pragma once

#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "scene/model/draw_items.hpp"
#include "scene/world/data/body_placement.hpp"
#include "scene/world/queries/ray_tree.hpp"

namespace enfilade::scene {

/// Static items, or those of bodies at one set of places, and their trees. Only SceneTrees uses the
/// members.
struct PlacedItems {
  /// Last snapshot in which bodies had these places.
  std::shared_ptr<const std::vector<BodySnapshot>> snapshot;
  std::vector<BodyPlacement> placements;       ///< by body; empty for static items
  std::vector<Eigen::Affine3d> worldFromItem;  ///< of bodies' items; empty for static items
  struct LazyTree {
    bool built = false;
    std::optional<RayTree> tree;  ///< nullopt: no such items
  };
  LazyTree trees[2];  ///< opaque, transparent
};

class SceneTrees {
 public:
  /// The trees that `scene` owns. Throws EmbreeError if Embree is unavailable.
  static SceneTrees& of(const Scene& scene);
  explicit SceneTrees(const Scene& scene);

  RTCDeviceTy* device() const { return meshes_.device(); }
  /// Origin of the trees, world, metres. Rays must be relative to it, to reduce float rounding.
  const Vec3& origin() const { return origin_; }

  const std::shared_ptr<PlacedItems>& staticItems() const { return static_; }
  /// Bodies as they are drawn, without triggers; null if there are none. Bodies at equal places
  /// share the result.
  std::shared_ptr<PlacedItems> placeBodies(const Snapshot& snapshot);
  /// The tree of the opaque or transparent items, valid as long as `placed`; null without such
  /// items. Throws as RayTree.
  const RayTree* findOrBuildTree(PlacedItems& placed, bool transparent);
  /// A tree of other meshes, which outlive the scene if they are instanced.
  RayTree buildTree(std::vector<TriangleBatch> batches);

  /// Trees built so far.
  struct Counts {
    std::size_t meshes = 0;  ///< for instancing
    std::size_t placed = 0;  ///< of static items and of bodies
  };
  Counts counts() const;

 private:
  void chooseInstancing();
  std::shared_ptr<PlacedItems> placeItems(std::vector<BodyPlacement> placements) const;
  std::vector<TriangleBatch> collectBatches(const PlacedItems& placed, bool transparent) const;

  const Scene& scene_;
  Vec3 origin_ = Vec3::Zero();
  const std::vector<DrawItem>& items_;
  std::vector<std::size_t> staticItems_, bodyItems_;  ///< indices into items_
  std::vector<bool> instanced_;                       ///< one per item
  std::shared_ptr<PlacedItems> static_ = std::make_shared<PlacedItems>();

  mutable std::mutex mutex_;  ///< guards the members below and those of PlacedItems
  MeshTrees meshes_;
  std::size_t placedTrees_ = 0;
  /// By last use. Worlds of one scene take turns, so several are kept.
  std::list<std::shared_ptr<PlacedItems>> bodies_;
};

}  // namespace enfilade::scene
