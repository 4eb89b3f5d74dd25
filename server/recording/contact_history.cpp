#include "server/recording/contact_history.hpp"

#include <algorithm>

#include "collision/assert.hpp"
#include "protocol/recording/recording.hpp"
#include "scene/world/active_contacts.hpp"
#include "server/messages/world_messages.hpp"

namespace enfilade::server {
namespace {

constexpr std::size_t kMaxTimelineEvents = 50'000;  // about 25 MB

}  // namespace

ContactHistory::ContactHistory(const std::filesystem::path& recording, std::uint32_t run,
                               std::uint64_t lastTick) {
  readRun(recording, run, lastTick);
  // The minimum of a near miss is reported when it ends, with its own, earlier tick.
  std::ranges::stable_sort(events_, {}, &v1::ContactEvent::tick);
}

/// Parses only the start and the events: states are most of a recording and are skipped.
void ContactHistory::readRun(const std::filesystem::path& recording, std::uint32_t run,
                             std::uint64_t lastTick) {
  protocol::mcap::Reader file(recording);
  std::uint32_t runIndex = 0;
  while (const auto message = file.next()) {
    const std::string& topic = message->channel->topic;
    if (topic == protocol::kStartTopic && ++runIndex > run) return;
    if (runIndex != run || (topic != protocol::kStartTopic && topic != protocol::kEventsTopic))
      continue;
    const auto item = protocol::parseRecordedItem(*message, recording);
    if (const auto* start = std::get_if<v1::RecordingStart>(&*item))
      firstTick_ = start->parent().tick();
    if (const auto* events = std::get_if<v1::TickEvents>(&*item)) {
      if (events->tick() > lastTick) return;
      addEvents(*events);
    }
  }
}

void ContactHistory::addEvents(const v1::TickEvents& events) {
  using Event = v1::ContactEvent;
  for (const Event& event : events.contacts()) {
    const bool begins = event.kind() == Event::KIND_BEGIN || event.kind() == Event::KIND_ENTER;
    if (begins) begins_[{event.kind(), event.a(), event.b()}].push_back(event);
    const bool isShown = begins || event.kind() == Event::KIND_BLOCKED ||
                         (event.kind() == Event::KIND_NEAR && event.phase() == Event::PHASE_MIN);
    if (!isShown || event.tick() > completeTo_) continue;
    if (events_.size() < kMaxTimelineEvents) {
      events_.push_back(event);
    } else {
      completeTo_ = event.tick() - 1;
    }
  }
}

v1::RecordedEvents ContactHistory::findEventsAfter(std::uint64_t tick, std::size_t maxBytes) const {
  constexpr std::size_t kFieldBytes = 8;  // maximum size of an event's tag and length
  v1::RecordedEvents reply;
  reply.set_complete_to(completeTo_);
  std::size_t bytes = 0;
  ENFILADE_ASSERT(std::ranges::is_sorted(events_, {}, &v1::ContactEvent::tick));
  auto next = std::ranges::upper_bound(events_, tick, {}, &v1::ContactEvent::tick);
  for (; next != events_.end(); ++next) {
    const v1::ContactEvent& event = *next;
    bytes += event.ByteSizeLong() + kFieldBytes;
    if (event.tick() > completeTo_) break;
    if (bytes > maxBytes) {
      reply.set_complete_to(event.tick() - 1);
      break;
    }
    *reply.add_contacts() = event;
  }
  // An incomplete tick would be asked for again.
  while (!reply.contacts().empty() &&
         reply.contacts(reply.contacts_size() - 1).tick() > reply.complete_to())
    reply.mutable_contacts()->RemoveLast();
  return reply;
}

/// The last begin or enter event of a contact up to `tick`; null: unknown.
const v1::ContactEvent* ContactHistory::findLastBegin(const Key& key, std::uint64_t tick) const {
  const auto found = begins_.find(key);
  if (found == begins_.end()) return nullptr;
  ENFILADE_ASSERT(std::ranges::is_sorted(found->second, {}, &v1::ContactEvent::tick));
  const auto firstAfter = std::upper_bound(
      found->second.begin(), found->second.end(), tick,
      [](std::uint64_t wanted, const v1::ContactEvent& event) { return wanted < event.tick(); });
  return firstAfter == found->second.begin() ? nullptr : &*std::prev(firstAfter);
}

v1::TickEvents ContactHistory::findActiveContactsAt(const scene::World& world) const {
  const scene::Snapshot& snapshot = *world.snapshot();
  v1::TickEvents active;
  active.set_tick(snapshot.tick);
  active.set_time(snapshot.time);
  for (const scene::ContactEvent& contact : scene::collectActiveContacts(world)) {
    v1::ContactEvent event = toProto(world, contact);
    if (const auto* beginEvent =
            findLastBegin({event.kind(), event.a(), event.b()}, snapshot.tick)) {
      *active.add_contacts() = *beginEvent;
    } else if (event.kind() == v1::ContactEvent::KIND_BEGIN) {
      event.set_tick(firstTick_);
      event.set_time(static_cast<double>(firstTick_) * world.settings().tickDuration);
      *active.add_contacts() = std::move(event);
    }
  }
  return active;
}

}  // namespace enfilade::server
