// What finds the things of a scene by name and by id, as it is at a tick, and where their convex
// parts stand then: for questions that somebody asks beside the tick.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "collision/compound/compound_distance.hpp"
#include "scene/world/data/scene.hpp"
#include "scene/world/data/snapshot.hpp"

namespace enfilade::scene {

/// Worked out once a scene.
class SceneIndex {
 public:
  explicit SceneIndex(std::shared_ptr<const Scene> scene);

  const Scene& scene() const { return *scene_; }
  /// The first of this path; 0: there is none.
  EntityId objectOfPath(const std::string& path) const;
  /// Index into Model::bodies; null: none is called so.
  const std::uint32_t* bodyNamed(const std::string& name) const;
  /// The body that the object `id` is part of, as bodyNamed().
  const std::uint32_t* bodyOfObject(EntityId id) const;

 private:
  std::shared_ptr<const Scene> scene_;
  std::unordered_map<std::string_view, EntityId> objects_;
  std::unordered_map<std::string_view, std::uint32_t> bodies_;
  std::unordered_map<EntityId, std::uint32_t> bodyOfObject_;
};

/// A scene as it is at a tick.
struct SceneThen {
  SceneIndex& index;
  const Snapshot& snapshot;
  const Scene& scene() const { return index.scene(); }
};

/// Null: `id` is none that is there.
const AvatarView* avatarOf(const SceneThen& then, EntityId id);
const BodyView* bodyOf(const SceneThen& then, EntityId id);

/// The entity with this id; of an object of a body the body. 0: none is there.
EntityId entityWith(const SceneThen& then, EntityId id);
/// By an avatar's or a body's name, or an object's path, in this order; 0: none is there.
EntityId entityNamed(const SceneThen& then, const std::string& name);
/// Its name, or its path; "" for none.
std::string nameOf(const SceneThen& then, EntityId entity);

/// The solid parts of an entity where they stand. Points into the scene and the snapshot.
struct Placed {
  std::vector<collision::TreeOfParts> trees;  ///< none: nothing of it can be touched
  std::size_t parts = 0;
  Box box;  ///< of all parts, scene frame: not smaller than theirs
  std::shared_ptr<const collision::BoxTree> own;  ///< of `trees`, where the scene holds none
};
/// Of an entity that is there.
Placed placedParts(const SceneThen& then, EntityId entity);
/// Its box, as Placed::box, without a look at its parts.
Box boxOf(const SceneThen& then, const BodyView& body);

/// Metres between two boxes.
double gapOf(const Box& a, const Box& b);

}  // namespace enfilade::scene
