// The contacts of a recorded run: their start times, and the events of a timeline. A world knows
// its active contacts, but not when they began. Playback from the middle of a recording takes these
// times from here.
#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <map>
#include <tuple>
#include <vector>

#include "protocol/enfilade.pb.h"
#include "scene/world/world.hpp"

namespace enfilade::server {

class ContactHistory {
 public:
  /// Reads run `run` of the recording up to `lastTick`, or up to its truncated end. Verifies all
  /// bytes that it reads. Throws protocol::mcap::RecordingError.
  explicit ContactHistory(const std::filesystem::path& recording, std::uint32_t run = 1,
                          std::uint64_t lastTick = std::numeric_limits<std::uint64_t>::max());

  /// The active contacts of `world`, which must be at a recorded tick. Each contact is a KIND_BEGIN
  /// with the tick at which it began; each entity inside a trigger is a KIND_ENTER. Old recordings
  /// of branches lack the initial contacts: these get the branch's first tick, and no KIND_ENTER.
  v1::TickEvents findActiveContactsAt(const scene::World& world) const;

  /// The events that a timeline shows (RecordedEventsRequest) after a tick, up to `maxBytes`.
  v1::RecordedEvents findEventsAfter(std::uint64_t tick, std::size_t maxBytes) const;

 private:
  using Key = std::tuple<v1::ContactEvent::Kind, std::uint32_t, std::uint32_t>;  ///< kind, a, b

  void readRun(const std::filesystem::path& recording, std::uint32_t run, std::uint64_t lastTick);
  void addEvents(const v1::TickEvents& events);
  const v1::ContactEvent* findLastBegin(const Key& key, std::uint64_t tick) const;

  std::uint64_t firstTick_ = 0;
  std::map<Key, std::vector<v1::ContactEvent>> begins_;  ///< ascending ticks
  std::vector<v1::ContactEvent> events_;                 ///< those of a timeline, ascending ticks
  std::uint64_t completeTo_ = std::numeric_limits<std::uint64_t>::max();  ///< tick; of events_
};

}  // namespace enfilade::server
