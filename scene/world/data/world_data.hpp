// The state of a World as plain data, changed by the tick alone.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "collision/broad_phase/sort_and_sweep.hpp"
#include "scene/world/data/avatar.hpp"
#include "scene/world/data/body.hpp"
#include "scene/world/data/contact.hpp"
#include "scene/world/data/dynamic_bodies.hpp"
#include "scene/world/data/orders.hpp"
#include "scene/world/data/scene.hpp"
#include "scene/world/data/snapshot.hpp"
#include "scene/world/data/world_settings.hpp"
#include "scene/world/data/world_threads.hpp"

namespace enfilade::scene {

/// Interval of the audit, and the proxy at which the next audit starts (audit.cpp).
struct AuditCursor {
  std::uint32_t everyTicks = 0;  ///< 0: never
  collision::ProxyId next = 0;   ///< first proxy to check, if it still exists
};

/// In place of an index into WorldData::avatars: no avatar.
inline constexpr std::uint32_t kNoAvatar = ~0u;

struct WorldData {
  /// Without bodies and snapshot; World adds them.
  WorldData(std::shared_ptr<const Scene> staticScene, const WorldSettings& worldSettings)
      : scene(std::move(staticScene)), settings(worldSettings), broadPhase(scene->staticBoxes()) {}

  std::shared_ptr<const Scene> scene;
  WorldSettings settings;
  std::uint64_t tick = 0;
  std::uint64_t hash = 0;  ///< chained over all ticks, seeded by scene and settings

  std::vector<Command> pendingCommands;  ///< since the last tick
  std::size_t queuedOrderCount = 0;      ///< queued orders and waypoints, at least
  std::vector<OrderQueue> queues;        ///< ascending names
  std::vector<Avatar> avatars;           ///< ascending names
  /// By entity id - firstAvatarId(), of all avatars that ever were in the world: the name, and the
  /// index into `avatars`; kNoAvatar: it left.
  std::vector<std::string> avatarNames;
  std::vector<std::uint32_t> avatarIndices;

  std::vector<BodyCommand> pendingBodyCommands;  ///< since the last tick
  std::vector<Body> bodies;                      ///< in the order of Model::bodies; constant size
  std::map<EntityId, std::uint32_t> bodyIndexById;            ///< index into `bodies`
  std::map<std::string_view, std::uint32_t> bodyIndexByName;  ///< by BodySpec::name
  BodyContacts bodyContacts;                                  ///< as reported: a, b
  /// Pairs of a kinematic body and another entity that were looked up so far. true: they touch at
  /// the start and are excluded (contacts/excluded_pairs.hpp). Determined by the scene.
  std::map<EntityPair, bool> excludedPairCache;
  std::vector<std::uint32_t> kinematicBodies, triggers;  ///< indices into `bodies`, ascending
  std::vector<std::uint32_t> movingBodies;               ///< kinematic, in this tick; ascending
  DynamicBodies dynamicBodies;                           ///< rigid bodies in the solver

  collision::SortAndSweep broadPhase;
  std::vector<EntityId> avatarByProxy;          ///< 0: no avatar; up to the last avatar's proxy
  std::vector<std::uint32_t> bodyIndexByProxy;  ///< kNoBody: no body; up to the last body's proxy
  std::shared_ptr<const Snapshot> snapshot;
  AuditCursor auditCursor;  ///< not part of the state: no result depends on it
  WorldThreads threads;

  EntityId firstAvatarId() const {
    return static_cast<EntityId>(scene->model().objects.size()) + 1;
  }

  /// A body's name, an object's path or an avatar's name, also of an avatar that left; "": unknown.
  std::string findEntityName(EntityId id) const;
  /// Null: not in the world. Valid until an avatar is inserted or erased.
  const Avatar* findAvatar(EntityId id) const;
  Avatar* findAvatar(EntityId id);
  const Avatar* findAvatarByName(std::string_view name) const;
  const Avatar* findAvatarByProxy(collision::ProxyId proxy) const;
  Avatar* findAvatarByProxy(collision::ProxyId proxy);
  std::uint32_t findBodyByProxy(collision::ProxyId proxy) const;  ///< kNoBody: no body
  const Body* findBodyByName(std::string_view name) const;        ///< null: no body
  const Contact* findBodyContact(const EntityPair& pair) const;   ///< in `bodyContacts`; null: none

  /// Adds an avatar that has a proxy, under the next id, which it returns.
  EntityId insertAvatar(Avatar avatar);
  void eraseAvatar(EntityId id);
  /// Recomputes `avatarIndices` and the avatars of the queues, after the avatars were read.
  void linkAvatars();
  void setAvatarProxy(Avatar& avatar, collision::ProxyId proxy);
};

}  // namespace enfilade::scene
