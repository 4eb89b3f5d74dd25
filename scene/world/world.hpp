// The world: a static scene with avatars and bodies, and their pending commands. The free functions
// below act on it. Commands take effect in tickWorld() only. Not thread-safe.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "scene/world/data/orders.hpp"
#include "scene/world/data/scene.hpp"
#include "scene/world/data/snapshot.hpp"
#include "scene/world/data/tick_report.hpp"
#include "scene/world/data/world_settings.hpp"

namespace enfilade::scene {

struct WorldData;

class World {
 public:
  explicit World(std::shared_ptr<const Scene> scene, const WorldSettings& settings = {});
  ~World();
  World(World&&) noexcept;
  World& operator=(World&&) noexcept;

  const Scene& scene() const;
  const WorldSettings& settings() const;
  std::shared_ptr<const Snapshot> snapshot() const;  ///< of the last tick; never null

  WorldData& data() { return *data_; }
  const WorldData& data() const { return *data_; }

 private:
  std::unique_ptr<WorldData> data_;
};

/// Enqueues a command for the next tick. If it is invalid or kMaxQueuedOrders is exceeded, returns
/// the error, which names the field and the value, and changes nothing. Rejects NaN, infinity,
/// coordinates beyond 1e7 m and speeds beyond the settings.
std::optional<std::string> submitAvatarCommand(World& world, Command command);

/// The same for a body command.
std::optional<std::string> submitBodyCommand(World& world, BodyCommand command);

/// Advances the world by WorldSettings::tickDuration.
TickReport tickWorld(World& world);

/// Number of threads of a tick, 1 to 64; 0 (default): two, or one on a single processor. They are
/// used where many avatars or bodies move. Results do not depend on it.
void setThreadCount(World& world, int threads);

/// Audits every `everyTicks`-th tick from now on; 0 (default): never. An audit compares the pairs
/// of the broad phase with brute force: proxies * (objects + proxies) box tests of about 5 ns. It
/// checks as many proxies as fit into 2 ms, at least one; the next audit continues after them.
void setAuditInterval(World& world, std::uint32_t everyTicks);

/// Ends and returns every contact with the given reason, for shutdown. Do not tick the world
/// afterwards.
std::vector<ContactEvent> endAllContacts(World& world, ContactEvent::Reason reason);

/// Path of a static object, name of a body, or name of a current or former avatar; "" for 0 or an
/// unknown id.
std::string findEntityName(const World& world, EntityId id);

}  // namespace enfilade::scene
