#include "server/recording/recordable_world.hpp"

#include "server/messages/body_messages.hpp"
#include "server/messages/world_messages.hpp"

namespace enfilade::server {
namespace {

v1::TickEvents eventsOf(const scene::World& world, const std::vector<scene::ContactEvent>& contacts,
                        const std::vector<scene::Notice>& notices) {
  const scene::Snapshot& snapshot = *world.snapshot();
  v1::TickEvents events;
  events.set_tick(snapshot.tick);
  events.set_time(snapshot.time);
  for (const scene::ContactEvent& event : contacts)
    *events.add_contacts() = messageOf(world, event);
  for (const scene::Notice& notice : notices)
    *events.add_notices() = messageOf(world, notice, snapshot.tick);
  return events;
}

std::vector<scene::Notice> everyoneLeaves(const scene::Snapshot& snapshot, const std::string& why) {
  std::vector<scene::Notice> left;
  for (const scene::AvatarView& avatar : snapshot.avatars) {
    scene::Notice notice;
    notice.kind = scene::Notice::Kind::left;
    notice.avatar = avatar.name;
    notice.id = avatar.id;
    notice.position = avatar.feet;
    notice.text = why;
    left.push_back(std::move(notice));
  }
  return left;
}

}  // namespace

RecordedWorld::RecordedWorld(scene::World world) : world_(std::move(world)) {}

void RecordedWorld::record(const RecordingOptions& options, const BranchPoint* branch) {
  recorder_ = std::make_unique<WorldRecorder>(options, world_, branch);
}

std::optional<v1::Error> RecordedWorld::submit(const v1::Command& command) {
  std::variant<scene::Command, v1::Error> order = commandFrom(command);
  if (auto* error = std::get_if<v1::Error>(&order)) return std::move(*error);
  if (const auto refused = scene::submit(world_, std::get<scene::Command>(std::move(order))))
    return refusalOf(command, *refused);
  if (recorder_) recorder_->took(command);
  return std::nullopt;
}

std::optional<v1::Error> RecordedWorld::submit(const v1::BodyCommand& command) {
  auto refused = server::submit(world_, command);
  if (!refused && recorder_) recorder_->took(command);
  return refused;
}

/// What a tick was told that fails for a fault of ours is the first that is asked for: it is kept.
scene::TickReport RecordedWorld::tickOrKeepCommands() {
  try {
    return scene::tick(world_);
  } catch (...) {
    if (recorder_) recorder_->tickFailed(world_);
    throw;
  }
}

RecordedWorld::Ticked RecordedWorld::tick() {
  Ticked ticked{tickOrKeepCommands(), {}};
  ticked.events = eventsOf(world_, ticked.report.contacts, ticked.report.notices);
  if (recorder_) recorder_->ticked(world_, ticked.events);
  return ticked;
}

v1::TickEvents RecordedWorld::end(v1::ContactEvent::Reason reason, const std::string& left) {
  const auto ended = scene::endContacts(world_, scene::ContactEvent::Reason::shutdown);
  const auto leaving =
      left.empty() ? std::vector<scene::Notice>() : everyoneLeaves(*world_.snapshot(), left);
  v1::TickEvents events = eventsOf(world_, ended, leaving);
  for (v1::ContactEvent& event : *events.mutable_contacts())
    if (event.reason() == v1::ContactEvent::REASON_SHUTDOWN) event.set_reason(reason);
  if (recorder_) recorder_->told(events);
  return events;
}

void RecordedWorld::beginAnew(scene::World world) {
  world_ = std::move(world);
  if (recorder_) recorder_->beganAnew(world_);
}

void RecordedWorld::goOnWith(scene::World world) {
  world_ = std::move(world);
  if (recorder_ && recorder_->close()) broke_ = true;
  recorder_.reset();
}

}  // namespace enfilade::server
