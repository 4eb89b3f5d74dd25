#include "tests/protocol/fake_world.hpp"

#include <cmath>

namespace enfilade::protocol {

std::optional<v1::Error> FakeWorld::submit(const v1::Command& command) {
  diary_.push_back(std::to_string(tick_) + ": " + command.ShortDebugString());
  if (command.walk().speed() > 10) {
    v1::Error error;
    error.set_code(v1::ERROR_REFUSED_COMMAND);
    error.set_field("speed");
    error.set_message("too fast");
    return error;
  }
  avatars_[command.avatar()].queue.push_back(command);
  return std::nullopt;
}

std::uint64_t FakeWorld::computeTicks(const std::string& name, const v1::Command& command) const {
  if (command.has_walk() && name.starts_with("stuck")) return kStuckTicks;
  if (command.has_walk())
    return kWalkTicks * static_cast<std::uint64_t>(command.walk().along_size());
  if (command.has_wait()) {
    return static_cast<std::uint64_t>(std::lround(command.wait().seconds() / tickSeconds()));
  }
  return 1;
}

/// Ends the first order, with the same reports as the real world.
void FakeWorld::end(const std::string& name, Avatar& avatar, StepOutcome& outcome) {
  const v1::Command order = avatar.queue.front();
  avatar.queue.pop_front();
  avatar.begun = false;
  v1::Notice notice;
  notice.set_tick(tick_);
  notice.set_avatar(name);
  notice.set_tag(order.tag());
  if (order.has_spawn() && name.starts_with("ghost")) {
    notice.set_kind(v1::Notice::KIND_REFUSED);
    notice.set_text("inside a wall");
    avatar.queue.clear();
  } else if (order.has_spawn()) {
    avatar.here = true;
    avatar.x = order.spawn().at().x();
    notice.set_kind(v1::Notice::KIND_SPAWNED);
  } else if (order.has_walk() && name.starts_with("stuck")) {
    notice.set_kind(v1::Notice::KIND_BLOCKED);
    notice.set_obstacle_name("Hall/Table#2");
  } else if (order.has_walk()) {
    avatar.x = order.walk().along(order.walk().along_size() - 1).x();
    notice.set_kind(v1::Notice::KIND_ARRIVED);
  } else if (order.has_capture()) {
    notice.set_kind(v1::Notice::KIND_CAPTURE);
    notice.set_text(order.capture().as());
  } else if (order.has_leave()) {
    avatar.here = false;
    notice.set_kind(v1::Notice::KIND_LEFT);
  } else {
    notice.set_kind(v1::Notice::KIND_DONE);
  }
  notice.mutable_position()->set_x(avatar.x);
  outcome.notices.push_back(notice);
}

void FakeWorld::advance(const std::string& name, Avatar& avatar, StepOutcome& outcome) {
  if (avatar.queue.empty()) return;
  if (!avatar.begun) {
    avatar.begun = true;
    avatar.ticksLeft = computeTicks(name, avatar.queue.front());
  }
  if (avatar.ticksLeft > 0) --avatar.ticksLeft;
  if (avatar.ticksLeft == 0) end(name, avatar, outcome);
}

std::optional<v1::Error> FakeWorld::submit(const v1::BodyCommand& command) {
  if (command.body().starts_with("no-")) {
    v1::Error error;
    error.set_code(v1::ERROR_REFUSED_COMMAND);
    error.set_message("there is no body of this name");
    return error;
  }
  diary_.push_back(std::to_string(tick_) + " " + command.body() + " " +
                   std::to_string(command.action_case()));
  return std::nullopt;
}

StepOutcome FakeWorld::step() {
  StepOutcome outcome;
  outcome.tick = ++tick_;
  outcome.time = static_cast<double>(tick_) * tickSeconds();
  outcome.idle = true;
  outcome.stateHash = tick_;
  for (auto& [name, avatar] : avatars_) {
    advance(name, avatar, outcome);
    if (!avatar.queue.empty() || name.starts_with("restless")) outcome.idle = false;
    outcome.stateHash = outcome.stateHash * 31 + static_cast<std::uint64_t>(avatar.x * 1000);
    if (!avatar.here) continue;
    v1::AvatarState state;
    state.set_name(name);
    state.mutable_feet()->set_x(avatar.x);
    outcome.avatars.push_back(state);
  }
  for (const v1::Notice& notice : outcome.notices) {
    if (notice.kind() != v1::Notice::KIND_CAPTURE) continue;
    CapturedFrame frame{notice.text(), notice.avatar(), notice.tag(), {}, {}, {}};
    frame.description.set_tick(tick_);
    if (notice.avatar().starts_with("blind")) frame.error = "no renderer";
    outcome.frames.push_back(frame);
  }
  return outcome;
}

}  // namespace enfilade::protocol
