// The static scene: the model, an AABB per object, and collision geometry built on first use.
// Immutable to its readers, thread-safe, shared by worlds.
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "scene/model/draw_items.hpp"
#include "scene/model/model.hpp"
#include "scene/model/object_classes.hpp"
#include "scene/model/shapes/collision_geometry.hpp"
#include "scene/world/data/body_shape.hpp"

namespace enfilade::scene {

class SceneTrees;

class Scene {
 public:
  /// Throws std::invalid_argument, naming the error in the model.
  explicit Scene(Model model);
  ~Scene();
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;

  const Model& model() const { return model_; }
  /// Static objects with collision: at least one triangle has an area and the object is not visual
  /// only. Box i of staticBoxes() belongs to object solidObjects()[i].
  const std::vector<std::uint32_t>& solidObjects() const { return solidObjects_; }
  const std::vector<Aabb>& staticBoxes() const { return staticBoxes_; }
  const Aabb& bounds() const { return bounds_; }  ///< of all objects, scene frame, metres
  /// Shape of model().bodies[body].
  std::shared_ptr<const BodyShape> bodyShape(std::size_t body) const { return bodyShapes_[body]; }
  /// Hash of everything that decides contact: geometry, poses and bodies. For Welcome and
  /// recordings.
  std::uint64_t hash() const { return hash_; }

  /// Shape of an object in its meshes' frame. Objects with the same meshes share one shape. Built
  /// at the first call, from any thread.
  const Shape& shape(std::uint32_t object) const;
  /// Collision geometry of an object in the scene's frame. Built at the first call, from any
  /// thread; all callers get the same instance.
  const CollisionGeometry& collisionGeometry(std::uint32_t object) const;

  /// Builds the collision geometry of these objects in a thread of its own, in this order, so that
  /// ticks find it ready. A tick that comes earlier builds it itself. Returns at once; results do
  /// not depend on it.
  void prefetchCollisionGeometry(std::span<const std::uint32_t> objects) const;
  /// Indices into solidObjects() of those that have many triangles.
  const std::vector<std::uint32_t>& denseIndices() const { return denseIndices_; }

  /// Class and thing of each object. Built at the first call, from any thread.
  const ObjectClasses& objectClasses() const;
  /// The initial box of each object, scene frame, metres; empty without a mesh. Built at the first
  /// call, from any thread.
  const std::vector<Aabb>& objectBoxes() const;

  /// The drawn meshes, and the rank of each object. Built at the first call, from any thread.
  const std::vector<DrawItem>& drawItems() const;
  const std::vector<CoplanarRank>& coplanarRanks() const;

  /// The trees for rays, made by the first call, from any thread. Use SceneTrees::of().
  SceneTrees& trees(const std::function<std::shared_ptr<SceneTrees>()>& make) const;

  std::size_t shapeCount() const { return meshesOfShape_.size(); }
  /// Index of the object's shape, < shapeCount().
  std::uint32_t shapeIndex(std::uint32_t object) const { return shapeIndexOfObject_[object]; }

  /// Bytes held for collision, in addition to the model.
  struct Memory {
    std::size_t geometry = 0;   ///< positions and triangles copied from the model
    std::size_t perObject = 0;  ///< boxes, indices and slots for collision geometry
    std::size_t parts = 0;      ///< collision geometry built so far
  };
  Memory memory() const;

 private:
  template <class T>
  struct LazyArray;
  class Prefetcher;
  void assignShapeIndices();
  void computeHashAndBoxes(const std::vector<bool>& isBodyObject);

  Model model_;
  std::vector<std::uint32_t> solidObjects_;
  std::vector<Aabb> staticBoxes_;
  std::vector<std::shared_ptr<const BodyShape>> bodyShapes_;
  Aabb bounds_;
  std::uint64_t hash_ = 0;
  std::vector<std::uint32_t> shapeIndexOfObject_;
  std::vector<std::vector<std::uint32_t>> meshesOfShape_;
  std::unique_ptr<LazyArray<Shape>> shapes_;
  std::unique_ptr<LazyArray<CollisionGeometry>> collisionGeometries_;
  std::vector<std::uint32_t> denseIndices_;
  mutable std::once_flag classesBuilt_, boxesBuilt_, ranksBuilt_, itemsBuilt_, treesMade_;
  mutable ObjectClasses classes_;
  mutable std::vector<Aabb> objectBoxes_;
  mutable std::vector<CoplanarRank> coplanarRanks_;
  mutable std::vector<DrawItem> drawItems_;
  mutable std::shared_ptr<SceneTrees> trees_;
  std::unique_ptr<Prefetcher> prefetcher_;  ///< last: its thread uses all others
};

}  // namespace enfilade::scene
