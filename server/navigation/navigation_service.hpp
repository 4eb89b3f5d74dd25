// Answers navigation queries of clients. Keeps the navigation meshes of the sizes that were asked
// for last. Not thread-safe.
#pragma once

#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "protocol/enfilade.pb.h"
#include "scene/navigation/navigation.hpp"
#include "scene/world/queries/entity_index.hpp"
#include "server/navigation/path_answer.hpp"

namespace enfilade::server {

/// The state of a world, for a query.
struct NavigationState {
  std::shared_ptr<const scene::Snapshot> snapshot;
  scene::WorldSettings settings;
  scene::Navigation::Progress progress = {};  ///< of building meshes; may be empty
  std::shared_ptr<KeptPaths> keptPaths = {};  ///< of its avatars; null: none is kept
};

class NavigationService {
 public:
  explicit NavigationService(std::shared_ptr<const scene::Scene> scene)
      : scene_(std::move(scene)) {}

  /// Returns the reply, or an error that names the field of the query. A map is written to
  /// `attachment`.
  std::variant<v1::NavigationReply, v1::Error> answer(const v1::NavigationQuery& query,
                                                      const NavigationState& state,
                                                      std::vector<std::uint8_t>& attachment);

 private:
  struct Entry {
    scene::NavigationAgent agent;
    scene::WorldSettings settings;
    bool doorsOpen = false;
    std::shared_ptr<const scene::Snapshot> snapshot;  ///< the poses of bodies
    std::unique_ptr<scene::Navigation> navigation;
    /// Of its islands, by Navigation::stateNumber().
    std::map<std::uint64_t, ClosedDoors> closedDoors;
  };
  /// The navigation of a size, brought to the state of the query.
  Entry& prepare(const scene::NavigationAgent& agent, bool doorsOpen, const NavigationState& state);

  /// The state of a world for the meshes: with open doors if that is asked for.
  std::shared_ptr<const scene::Snapshot> makeMeshSnapshot(bool doorsOpen,
                                                          const NavigationState& state);
  void keep(Entry entry);
  /// Takes saved meshes for a size; nullopt: done.
  std::optional<v1::Error> load(const scene::NavigationAgent& agent, bool doorsOpen,
                                const NavigationState& state, const std::string& mesh);

  std::shared_ptr<const scene::Scene> scene_;
  std::optional<scene::EntityIndex> index_;  ///< built at first use
  std::list<Entry> entries_;                 ///< most recently used first
  /// A new world with open doors, made at first use, and its settings.
  std::shared_ptr<const scene::Snapshot> openDoors_;
  scene::WorldSettings openDoorsSettings_;
};

}  // namespace enfilade::server
