#include "server/runs/in_process_driver.hpp"

#include "server/messages/frame_messages.hpp"
#include "server/messages/world_messages.hpp"

namespace enfilade::server {
InProcessDriver::InProcessDriver(RecordedWorld& world, render::Renderer* renderer,
                                 protocol::CaptureFormat format)
    : world_(world), renderer_(renderer), format_(std::move(format)) {}

double InProcessDriver::tickSeconds() const {
  return world_.lengths().tick;
}

std::optional<v1::Error> InProcessDriver::submit(const v1::Command& command) {
  return world_.submit(command);
}

std::optional<v1::Error> InProcessDriver::submit(const v1::BodyCommand& command) {
  return world_.submit(command);
}

protocol::StepOutcome InProcessDriver::step() {
  auto [report, events] = world_.tick();
  statistics_.add(report);
  logFindings(world_, report);
  const scene::Snapshot& snapshot = *report.snapshot;
  protocol::StepOutcome outcome;
  outcome.tick = snapshot.tick;
  outcome.time = snapshot.time;
  outcome.stateHash = snapshot.stateHash;
  outcome.idle = report.idle;
  for (v1::ContactEvent& event : *events.mutable_contacts())
    outcome.contacts.push_back(std::move(event));
  for (v1::Notice& notice : *events.mutable_notices()) {
    outcome.notices.push_back(std::move(notice));
    if (outcome.notices.back().kind() == v1::Notice::KIND_CAPTURE)
      outcome.frames.push_back(capture(outcome.notices.back()));
  }
  recordPictures();
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
    record(notice.avatar(), taken);
    captured.description = std::move(taken.description);
    captured.pixels = std::move(taken.pixels);
  } catch (const protocol::ProtocolError& problem) {
    captured.error = problem.what();
  }
  return captured;
}

void InProcessDriver::record(const std::string& avatar, const protocol::ReceivedFrame& taken) {
  WorldRecorder* recorder = world_.recorder();
  if (!recorder || !recorder->takesPictures()) return;
  if (const auto picture = encodedPicture(taken.description, taken.pixels))
    recorder->picture(avatar, taken.description, *picture);
}

void InProcessDriver::recordPictures() {
  if (!renderer_ || !world_.recorder() || !world_.recorder()->picturesDue(world_)) return;
  for (const scene::AvatarView& avatar : world_.snapshot()->avatars)
    record(avatar.name, frame(recordedView(avatar.name)));
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
  const v1::TickEvents ended = world_.end(v1::ContactEvent::REASON_SHUTDOWN);
  return {ended.contacts().begin(), ended.contacts().end()};
}

}  // namespace enfilade::server
