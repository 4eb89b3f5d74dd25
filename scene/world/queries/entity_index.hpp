// Finds the entities of a scene at a tick by name and by id, with their placed convex parts: for
// queries outside the tick.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "collision/compound/compound_view.hpp"
#include "scene/world/data/scene.hpp"
#include "scene/world/data/snapshot.hpp"

namespace enfilade::scene {

/// Index of a scene's objects and bodies. Built once per scene.
class EntityIndex {
 public:
  explicit EntityIndex(std::shared_ptr<const Scene> scene);

  const Scene& scene() const { return *scene_; }
  /// The first object with this path; 0: unknown.
  EntityId findObject(const std::string& path) const;
  /// Index into Model::bodies; null: unknown.
  const std::uint32_t* findBody(const std::string& name) const;
  /// The body that contains object `id`, as findBody().
  const std::uint32_t* findBodyOfObject(EntityId id) const;

 private:
  std::shared_ptr<const Scene> scene_;
  std::unordered_map<std::string_view, EntityId> objects_;
  std::unordered_map<std::string_view, std::uint32_t> bodies_;
  std::unordered_map<EntityId, std::uint32_t> bodyOfObject_;
};

/// A scene in its state at a tick.
struct SceneAt {
  EntityIndex& index;
  const Snapshot& snapshot;
  const Scene& scene() const { return index.scene(); }
};

/// Null if no such entity is present.
const AvatarSnapshot* findAvatarSnapshot(const SceneAt& sceneAt, EntityId id);
const BodySnapshot* findBodySnapshot(const SceneAt& sceneAt, EntityId id);

/// The entity with this id; for an object of a body, the body. 0: not present.
EntityId resolveEntity(const SceneAt& sceneAt, EntityId id);
/// Looks up an avatar's name, then a body's name, then an object's path; 0: not present.
EntityId findEntity(const SceneAt& sceneAt, const std::string& name);
/// The entity's name or path; "" if unknown.
std::string lookUpEntityName(const SceneAt& sceneAt, EntityId entity);

/// The solid parts of an entity at its pose. Points into the scene and the snapshot.
struct PlacedEntity {
  std::vector<collision::CompoundView> compounds;  ///< empty: the entity is not solid
  std::size_t partCount = 0;
  Aabb box;                                             ///< contains all parts, scene frame
  std::shared_ptr<const collision::BoxTree> ownedTree;  ///< owns the tree in `compounds` that the
                                                        ///< scene does not own
};
/// `entity` must be present.
PlacedEntity makePlacedEntity(const SceneAt& sceneAt, EntityId entity);
/// Like PlacedEntity::box, but without visiting the parts; may be larger.
Aabb computeBodyAabb(const SceneAt& sceneAt, const BodySnapshot& body);

}  // namespace enfilade::scene
