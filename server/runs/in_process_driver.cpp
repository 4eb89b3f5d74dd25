#include "server/runs/in_process_driver.hpp"

#include "scene/world/data/world_data.hpp"
#include "server/messages/frame_encoding.hpp"
#include "server/messages/world_messages.hpp"
#include "server/navigation/go_order.hpp"

namespace enfilade::server {
InProcessDriver::InProcessDriver(RecordableWorld& world, render::RendererSelector* renderer,
                                 protocol::CaptureFormat format)
    : world_(world), renderer_(renderer), format_(std::move(format)) {}

double InProcessDriver::tickSeconds() const {
  return world_.settings().tickDuration;
}

std::optional<v1::Error> InProcessDriver::submit(const v1::Command& command) {
  return command.has_go() ? go(command) : world_.submit(command);
}

std::optional<v1::Error> InProcessDriver::go(const v1::Command& command) {
  auto query = makePathQuery(world_, command);
  if (auto* error = std::get_if<v1::Error>(&query)) return std::move(*error);
  if (!navigation_) navigation_.emplace(static_cast<const scene::World&>(world_).data().scene);
  std::vector<std::uint8_t> attachment;
  auto made =
      makeGoOrder(command, navigation_->answer(std::get<v1::NavigationQuery>(query),
                                               {world_.snapshot(), world_.settings()}, attachment));
  if (auto* error = std::get_if<v1::Error>(&made)) return std::move(*error);
  return world_.submit(std::get<v1::Command>(made));
}

std::optional<v1::Error> InProcessDriver::submit(const v1::BodyCommand& command) {
  return world_.submit(command);
}

protocol::StepOutcome InProcessDriver::step() {
  auto [report, events] = world_.tick();
  statistics_.addTick(report);
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
  recordImages();
  for (const auto& avatar : snapshot.avatars) outcome.avatars.push_back(toProto(world_, avatar));
  return outcome;
}

protocol::CapturedFrame InProcessDriver::capture(const v1::Notice& notice) {
  return protocol::captureFrame(notice, format_, [&](const v1::FrameRequest& request) {
    protocol::ReceivedFrame received = frame(request);
    record(notice.avatar(), received);
    return received;
  });
}

void InProcessDriver::record(const std::string& avatar, const protocol::ReceivedFrame& received) {
  WorldRecorder* recorder = world_.recorder();
  if (!recorder || !recorder->recordsImages()) return;
  if (const auto picture = extractImage(received.description, received.pixels))
    recorder->writeImage(avatar, received.description, *picture);
}

void InProcessDriver::recordImages() {
  if (!renderer_ || !world_.recorder() || !world_.recorder()->areImagesDue(world_)) return;
  for (const scene::AvatarSnapshot& avatar : world_.snapshot()->avatars)
    record(avatar.name, frame(makeRecordedViewRequest(avatar.name)));
}

protocol::ReceivedFrame InProcessDriver::frame(const v1::FrameRequest& request) {
  if (!renderer_) throw protocol::ProtocolError(v1::ERROR_NO_RENDERER, "no renderer is available");
  const auto snapshot = world_.snapshot();
  if (hasFlow(request))
    throw protocol::ProtocolError(v1::ERROR_UNSUPPORTED, "flow needs a server", "channels");
  const std::variant<render::ViewRequest, v1::Error> view = viewFromProto(request, *snapshot);
  if (const auto* error = std::get_if<v1::Error>(&view)) {
    throw protocol::ProtocolError(error->code(), error->message(), error->field());
  }
  const render::ViewRequest& frameView = std::get<render::ViewRequest>(view);
  try {
    const render::Frame rendered =
        renderer_->render(*snapshot, frameView.camera, frameView.options, frameView.renderer);
    ++frames_;
    protocol::ReceivedFrame received;
    received.description =
        encodeFrame(rendered, {request, world_.scene(), *snapshot}, received.pixels);
    return received;
  } catch (const render::RenderError& error) {
    throw protocol::ProtocolError(v1::ERROR_INTERNAL, error.what());
  }
}

v1::Metrics InProcessDriver::metrics() const {
  v1::Metrics metrics = statistics_.makeMetrics();
  metrics.set_frames(frames_);
  return metrics;
}

std::vector<v1::ContactEvent> InProcessDriver::endContacts() {
  const v1::TickEvents ended = world_.endContacts(v1::ContactEvent::REASON_SHUTDOWN);
  return {ended.contacts().begin(), ended.contacts().end()};
}

}  // namespace enfilade::server
