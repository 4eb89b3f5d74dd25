#include "server/recording/recordable_world.hpp"

#include "collision/assert.hpp"
#include "server/messages/body_messages.hpp"
#include "server/messages/name_suggestions.hpp"
#include "server/messages/order_messages.hpp"
#include "server/messages/world_messages.hpp"

namespace enfilade::server {
namespace {

v1::TickEvents makeTickEvents(const scene::World& world,
                              const std::vector<scene::ContactEvent>& contacts,
                              const std::vector<scene::Notice>& notices) {
  const scene::Snapshot& snapshot = *world.snapshot();
  v1::TickEvents events;
  events.set_tick(snapshot.tick);
  events.set_time(snapshot.time);
  for (const scene::ContactEvent& event : contacts) *events.add_contacts() = toProto(world, event);
  constexpr int kMaxSuggestions = 4;  // a tick: each may take 1 ms
  int suggestions = 0;
  for (const scene::Notice& notice : notices) {
    v1::Notice& message = *events.add_notices() = toProto(world, notice, snapshot.tick);
    if (notice.isAvatarUnknown && suggestions++ < kMaxSuggestions)
      message.mutable_text()->append(suggestAvatar(world, notice.avatar));
  }
  return events;
}

std::vector<scene::Notice> makeLeaveNotices(const scene::Snapshot& snapshot,
                                            const std::string& reason) {
  std::vector<scene::Notice> notices;
  for (const scene::AvatarSnapshot& avatar : snapshot.avatars) {
    scene::Notice notice;
    notice.kind = scene::Notice::Kind::left;
    notice.avatar = avatar.name;
    notice.id = avatar.id;
    notice.position = avatar.footPosition;
    notice.text = reason;
    notices.push_back(std::move(notice));
  }
  return notices;
}

}  // namespace

RecordableWorld::RecordableWorld(scene::World world) : world_(std::move(world)) {}

void RecordableWorld::record(const RecordingOptions& options, const BranchPoint* branch) {
  ENFILADE_ASSERT(!recorder_);
  recorder_ = std::make_unique<WorldRecorder>(options, world_, branch);
}

std::optional<v1::Error> RecordableWorld::submit(const v1::Command& command) {
  std::variant<scene::Command, v1::Error> order = commandFromProto(command);
  if (auto* error = std::get_if<v1::Error>(&order)) return std::move(*error);
  if (const auto refusal =
          scene::submitAvatarCommand(world_, std::get<scene::Command>(std::move(order))))
    return makeRefusalError(command, *refusal + (refusal->find("no body named") == std::string::npos
                                                     ? ""
                                                     : suggestBodies(world_, command)));
  if (recorder_) recorder_->onCommand(command);
  return std::nullopt;
}

std::optional<v1::Error> RecordableWorld::submit(const v1::BodyCommand& command) {
  auto refusal = server::submitBodyCommand(world_, command);
  if (!refusal && recorder_) recorder_->onBodyCommand(command);
  return refusal;
}

/// Runs a tick. If it throws (an internal error), its commands are saved for reproduction.
scene::TickReport RecordableWorld::tickOrSaveCommands() {
  try {
    return scene::tickWorld(world_);
  } catch (...) {
    if (recorder_) recorder_->onTickFailed(world_);
    throw;
  }
}

RecordableWorld::TickResult RecordableWorld::tick() {
  TickResult result{tickOrSaveCommands(), {}};
  result.events = makeTickEvents(world_, result.report.contacts, result.report.notices);
  if (recorder_) recorder_->onTick(world_, result.events);
  return result;
}

v1::TickEvents RecordableWorld::endContacts(v1::ContactEvent::Reason reason,
                                            const std::string& leaveReason) {
  const auto ended = scene::endAllContacts(world_, scene::ContactEvent::Reason::shutdown);
  const auto leaveNotices = leaveReason.empty() ? std::vector<scene::Notice>()
                                                : makeLeaveNotices(*world_.snapshot(), leaveReason);
  v1::TickEvents events = makeTickEvents(world_, ended, leaveNotices);
  for (v1::ContactEvent& event : *events.mutable_contacts())
    if (event.reason() == v1::ContactEvent::REASON_SHUTDOWN) event.set_reason(reason);
  if (recorder_) recorder_->onEvents(events);
  return events;
}

void RecordableWorld::reset(scene::World world) {
  ENFILADE_ASSERT(world.snapshot()->tick == 0);
  world_ = std::move(world);
  if (recorder_) recorder_->onReset(world_);
}

void RecordableWorld::restore(scene::World world, const v1::TickEvents& activeContacts) {
  world_ = std::move(world);
  if (recorder_) recorder_->onRestore(world_, activeContacts);
}

void RecordableWorld::switchTo(scene::World world) {
  world_ = std::move(world);
  if (recorder_ && recorder_->close()) recordingFailed_ = true;
  recorder_.reset();
}

}  // namespace enfilade::server
