#include "server/recording/contact_history.hpp"

#include <algorithm>

#include "protocol/recording/recording.hpp"
#include "scene/world/contacts/active_contacts.hpp"
#include "server/messages/world_messages.hpp"

namespace enfilade::server {

/// States are the most of a recording, and not looked at: only the events are parsed.
ContactHistory::ContactHistory(const std::filesystem::path& recording, std::uint32_t run,
                               std::uint64_t lastTick) {
  protocol::mcap::Reader file(recording);
  std::uint32_t begun = 0;
  while (const auto message = file.next()) {
    const std::string& topic = message->channel->topic;
    if (topic == protocol::kStartTopic && ++begun > run) return;
    if (begun != run || (topic != protocol::kStartTopic && topic != protocol::kEventsTopic))
      continue;
    const auto item = protocol::itemFrom(*message, recording);
    if (const auto* start = std::get_if<v1::RecordingStart>(&*item))
      firstTick_ = start->parent().tick();
    if (const auto* events = std::get_if<v1::TickEvents>(&*item)) {
      if (events->tick() > lastTick) return;
      add(*events);
    }
  }
}

void ContactHistory::add(const v1::TickEvents& events) {
  for (const v1::ContactEvent& event : events.contacts())
    if (event.kind() == v1::ContactEvent::KIND_BEGIN ||
        event.kind() == v1::ContactEvent::KIND_ENTER)
      begun_[{event.kind(), event.a(), event.b()}].push_back(event);
}

/// Null where none is known.
const v1::ContactEvent* ContactHistory::lastBegun(const Key& key, std::uint64_t tick) const {
  const auto found = begun_.find(key);
  if (found == begun_.end()) return nullptr;
  const auto after = std::upper_bound(
      found->second.begin(), found->second.end(), tick,
      [](std::uint64_t wanted, const v1::ContactEvent& event) { return wanted < event.tick(); });
  return after == found->second.begin() ? nullptr : &*std::prev(after);
}

v1::TickEvents ContactHistory::livingIn(const scene::World& world) const {
  const scene::Snapshot& snapshot = *world.snapshot();
  v1::TickEvents living;
  living.set_tick(snapshot.tick);
  living.set_time(snapshot.time);
  for (const scene::ContactEvent& contact : scene::livingContacts(world)) {
    v1::ContactEvent event = messageOf(world, contact);
    if (const auto* begun = lastBegun({event.kind(), event.a(), event.b()}, snapshot.tick)) {
      *living.add_contacts() = *begun;
    } else if (event.kind() == v1::ContactEvent::KIND_BEGIN) {
      event.set_tick(firstTick_);
      event.set_time(static_cast<double>(firstTick_) * world.lengths().tick);
      *living.add_contacts() = std::move(event);
    }
  }
  return living;
}

}  // namespace enfilade::server
