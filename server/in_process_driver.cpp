#include "server/in_process_driver.hpp"

#include "server/body_messages.hpp"
#include "server/frame_messages.hpp"
#include "server/world_messages.hpp"

namespace enfilade::server {
namespace {

v1::TickEvents eventsOf(const protocol::StepOutcome& outcome) {
  v1::TickEvents events;
  events.set_tick(outcome.tick);
  events.set_time(outcome.time);
  events.mutable_contacts()->Assign(outcome.contacts.begin(), outcome.contacts.end());
  events.mutable_notices()->Assign(outcome.notices.begin(), outcome.notices.end());
  return events;
}

}  // namespace

InProcessDriver::InProcessDriver(scene::World& world, render::Renderer* renderer,
                                 protocol::CaptureFormat format, WorldRecorder* recorder)
    : world_(world), renderer_(renderer), format_(std::move(format)), recorder_(recorder) {}

double InProcessDriver::tickSeconds() const {
  return world_.lengths().tick;
}

std::optional<v1::Error> InProcessDriver::submit(const v1::Command& command) {
  std::variant<scene::Command, v1::Error> order = commandFrom(command);
  if (auto* error = std::get_if<v1::Error>(&order)) return std::move(*error);
  auto refused = scene::submit(world_, std::get<scene::Command>(std::move(order)));
  if (refused) return refusalOf(command, *refused);
  if (recorder_) recorder_->took(command);
  return std::nullopt;
}

std::optional<v1::Error> InProcessDriver::submit(const v1::BodyCommand& command) {
  auto refused = server::submit(world_, command);
  if (!refused && recorder_) recorder_->took(command);
  return refused;
}

protocol::StepOutcome InProcessDriver::step() {
  const scene::TickReport report = scene::tick(world_);
  statistics_.add(report);
  logFindings(world_, report);
  const scene::Snapshot& snapshot = *report.snapshot;
  protocol::StepOutcome outcome;
  outcome.tick = snapshot.tick;
  outcome.time = snapshot.time;
  outcome.stateHash = snapshot.stateHash;
  outcome.idle = report.idle;
  for (const auto& event : report.contacts) outcome.contacts.push_back(messageOf(world_, event));
  for (const auto& notice : report.notices) {
    outcome.notices.push_back(messageOf(world_, notice, snapshot.tick));
    if (notice.kind == scene::Notice::Kind::capture) {
      outcome.frames.push_back(capture(outcome.notices.back()));
    }
  }
  if (recorder_) recorder_->ticked(world_, eventsOf(outcome));
  for (const auto& avatar : snapshot.avatars) outcome.avatars.push_back(messageOf(world_, avatar));
  return outcome;
}

protocol::CapturedFrame InProcessDriver::capture(const v1::Notice& notice) {
  protocol::CapturedFrame captured;
  captured.name = notice.text();
  captured.avatar = notice.avatar();
  captured.tag = notice.tag();
  try {
    protocol::ReceivedFrame taken = frame(protocol::captureRequest(notice, format_));
    captured.description = std::move(taken.description);
    captured.pixels = std::move(taken.pixels);
  } catch (const protocol::ProtocolError& problem) {
    captured.error = problem.what();
  }
  return captured;
}

protocol::ReceivedFrame InProcessDriver::frame(const v1::FrameRequest& request) {
  if (!renderer_) throw protocol::ProtocolError(v1::ERROR_NO_RENDERER, "there is no renderer");
  const auto snapshot = world_.snapshot();
  const std::variant<View, v1::Error> view = viewFrom(request, *snapshot);
  if (const auto* error = std::get_if<v1::Error>(&view)) {
    throw protocol::ProtocolError(error->code(), error->message(), error->field());
  }
  const View& usable = std::get<View>(view);
  try {
    const render::Frame drawn =
        renderer_->render(*snapshot, usable.camera, usable.options, usable.renderer);
    ++frames_;
    protocol::ReceivedFrame taken;
    taken.description = messageOf(drawn, snapshot->time, request, taken.pixels);
    return taken;
  } catch (const render::RenderError& error) {
    throw protocol::ProtocolError(v1::ERROR_INTERNAL, error.what());
  }
}

v1::Metrics InProcessDriver::metrics() const {
  v1::Metrics metrics = statistics_.metrics();
  metrics.set_frames(frames_);
  return metrics;
}

std::vector<v1::ContactEvent> InProcessDriver::endContacts() {
  std::vector<v1::ContactEvent> messages;
  for (const auto& event : scene::endContacts(world_, scene::ContactEvent::Reason::shutdown)) {
    messages.push_back(messageOf(world_, event));
  }
  return messages;
}

}  // namespace enfilade::server
