// When the contacts of a recorded walk began. A world knows which contacts live in it, but not
// since when; who begins in the middle of a recording tells it from here.
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
  /// Reads the run of the recording, up to `lastTick`, or to where it was cut off. Checks all bytes
  /// that it reads. Throws protocol::mcap::RecordingError.
  explicit ContactHistory(const std::filesystem::path& recording, std::uint32_t run = 1,
                          std::uint64_t lastTick = std::numeric_limits<std::uint64_t>::max());

  /// What lives in `world`, which is that of a recorded tick: each contact as KIND_BEGIN, with the
  /// tick at which it began, and as KIND_ENTER who is in a trigger. Branches that were recorded
  /// before they told what lived at their beginning have their first tick for it, and no
  /// KIND_ENTER.
  v1::TickEvents livingIn(const scene::World& world) const;

 private:
  using Key = std::tuple<v1::ContactEvent::Kind, std::uint32_t, std::uint32_t>;  ///< kind, a, b

  void add(const v1::TickEvents& events);
  const v1::ContactEvent* lastBegun(const Key& key, std::uint64_t tick) const;

  std::uint64_t firstTick_ = 0;
  std::map<Key, std::vector<v1::ContactEvent>> begun_;  ///< ascending ticks
};

}  // namespace enfilade::server
