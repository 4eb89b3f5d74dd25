#include "server/hosting/frame_service.hpp"

#include <spdlog/spdlog.h>

#include "render/service/render_thread.hpp"
#include "server/base/work_thread.hpp"
#include "server/messages/world_messages.hpp"

namespace enfilade::server {

namespace {

struct PendingFrame {
  FrameJob job;
  std::future<render::Frame> frame;
  std::function<void(EncodedMessage)> done;
};

EncodedMessage encodeFrameReply(PendingFrame& pending) {
  const render::Frame frame = pending.frame.get();
  std::vector<std::uint8_t> attachment;
  v1::ServerMessage reply;
  reply.set_reply_to(pending.job.requestId);
  *reply.mutable_frame() =
      toProto(frame, pending.job.snapshot->time, pending.job.request, attachment);
  reply.mutable_frame()->set_watch(pending.job.subscription);
  reply.mutable_frame()->set_dropped(pending.job.dropped);
  if (pending.job.onRendered) pending.job.onRendered(reply.frame(), attachment);
  return encodeShared(reply, std::move(attachment));
}

}  // namespace

struct FrameService::State {
  std::atomic<int> pendingEncodes = 0;  ///< frames queued for encoding on `thread`
  WorkThread thread;
  std::unique_ptr<render::RenderThread> renderer;  // destroyed first: it may still call back
};

namespace {

EncodedMessage makeReply(PendingFrame& pending) {
  try {
    EncodedMessage encoded = encodeFrameReply(pending);
    if (pending.job.renderedCount) ++*pending.job.renderedCount;
    return encoded;
  } catch (const render::RendererUnavailable& error) {
    return makeErrorReply(pending.job.requestId,
                          makeError(v1::ERROR_NO_RENDERER, error.what(), "renderer"));
  } catch (const std::exception& error) {
    spdlog::error("cannot render a frame: {}", error.what());
    return makeErrorReply(pending.job.requestId, makeError(v1::ERROR_INTERNAL, error.what()));
  }
}

/// Whether the reply only copies a few raw pixels.
bool isCheapReply(const FrameJob& job) {
  constexpr std::uint64_t kSmallFrameThreshold = 512 * 512;
  if (std::uint64_t{job.request.width()} * job.request.height() > kSmallFrameThreshold)
    return false;
  const bool raw = job.request.rgb_encoding() != v1::ENCODING_PNG &&
                   job.request.rgb_encoding() != v1::ENCODING_JPEG;
  return raw && !job.onRendered;
}

}  // namespace

FrameService::FrameService(std::shared_ptr<const scene::Scene> scene, const DrawingOptions& drawing)
    : state_(std::make_unique<State>()) {
  state_->renderer =
      std::make_unique<render::RenderThread>(std::move(scene), drawing.device, drawing.renderer);
  if (drawing.isRequested() && !unavailableReason().empty())
    throw render::RenderError(unavailableReason());
}

FrameService::~FrameService() {
  finish();
}

void FrameService::finish() {
  state_->thread.finish();
  state_->renderer.reset();
}

void FrameService::prepare() {
  state_->thread.post([&renderer = *state_->renderer] {
    if (!renderer.unavailableReason().empty())
      return spdlog::warn("no frames: {}", renderer.unavailableReason());
    if (!renderer.deviceWarning().empty()) spdlog::warn(renderer.deviceWarning());
  });
}

const std::string& FrameService::deviceName() const {
  return state_->renderer->deviceName();
}
bool FrameService::isSoftware() const {
  return state_->renderer->software();
}
const std::string& FrameService::unavailableReason() const {
  return state_->renderer->unavailableReason();
}

/// A cheap reply is built on the render thread, which delays the next frame by one copy. Other
/// frames are encoded on `thread`. No reply overtakes the frames queued there.
void FrameService::renderFrame(FrameJob job, std::function<void(EncodedMessage)> done) {
  State& state = *state_;
  const auto pending =
      std::make_shared<PendingFrame>(PendingFrame{std::move(job), {}, std::move(done)});
  const FrameView& view = pending->job.view;
  if (isCheapReply(pending->job) && state.pendingEncodes == 0) {
    return state.renderer->render(pending->job.snapshot, view.camera, view.options, view.renderer,
                                  [pending](std::future<render::Frame> frame) {
                                    pending->frame = std::move(frame);
                                    pending->done(makeReply(*pending));
                                  });
  }
  ++state.pendingEncodes;
  pending->frame =
      state.renderer->render(pending->job.snapshot, view.camera, view.options, view.renderer);
  state.thread.post([&state, pending] {
    pending->done(makeReply(*pending));
    --state.pendingEncodes;
  });
}

}  // namespace enfilade::server
