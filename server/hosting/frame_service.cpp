#include "server/hosting/frame_service.hpp"

#include <spdlog/spdlog.h>

#include "render/service/render_thread.hpp"
#include "server/base/work_thread.hpp"
#include "server/messages/world_messages.hpp"

namespace enfilade::server {

namespace {

struct Drawing {
  FrameJob job;
  std::future<render::Frame> frame;
  std::function<void(Encoded)> done;
};

Encoded frameReply(Drawing& drawing) {
  const render::Frame frame = drawing.frame.get();
  std::vector<std::uint8_t> attachment;
  v1::ServerMessage reply;
  reply.set_reply_to(drawing.job.requestId);
  *reply.mutable_frame() =
      messageOf(frame, drawing.job.snapshot->time, drawing.job.request, attachment);
  reply.mutable_frame()->set_watch(drawing.job.watch);
  reply.mutable_frame()->set_dropped(drawing.job.dropped);
  if (drawing.job.seen) drawing.job.seen(reply.frame(), attachment);
  return encodeShared(reply, std::move(attachment));
}

}  // namespace

struct FrameService::State {
  std::atomic<int> toEncode = 0;  ///< pictures whose reply is made, or will be, by `thread`
  WorkThread thread;
  std::unique_ptr<render::RenderThread> renderer;  // first to go: it may still call back
};

namespace {

Encoded replyTo(Drawing& drawing) {
  try {
    Encoded whole = frameReply(drawing);
    if (drawing.job.drawn) ++*drawing.job.drawn;
    return whole;
  } catch (const render::NoRenderer& error) {
    return errorReply(drawing.job.requestId,
                      errorOf(v1::ERROR_NO_RENDERER, error.what(), "renderer"));
  } catch (const std::exception& error) {
    spdlog::error("a picture could not be made: {}", error.what());
    return errorReply(drawing.job.requestId, errorOf(v1::ERROR_INTERNAL, error.what()));
  }
}

/// The reply is no more work than copying a few pixels.
bool isReadyAsDrawn(const FrameJob& job) {
  constexpr std::uint64_t kFewPixels = 512 * 512;
  if (std::uint64_t{job.request.width()} * job.request.height() > kFewPixels) return false;
  const bool raw = job.request.rgb_encoding() != v1::ENCODING_PNG &&
                   job.request.rgb_encoding() != v1::ENCODING_JPEG;
  return raw && !job.seen;
}

}  // namespace

FrameService::FrameService(std::shared_ptr<const scene::Scene> scene, const DrawingOptions& drawing)
    : state_(std::make_unique<State>()) {
  state_->renderer =
      std::make_unique<render::RenderThread>(std::move(scene), drawing.device, drawing.renderer);
  if (drawing.asked() && !whyNone().empty()) throw render::RenderError(whyNone());
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
    if (!renderer.whyNone().empty()) return spdlog::warn("no pictures: {}", renderer.whyNone());
    if (!renderer.deviceNote().empty()) spdlog::warn(renderer.deviceNote());
  });
}

const std::string& FrameService::deviceName() const {
  return state_->renderer->deviceName();
}
bool FrameService::software() const {
  return state_->renderer->software();
}
const std::string& FrameService::whyNone() const {
  return state_->renderer->whyNone();
}

/// What is ready as it is drawn is handed over by the thread that drew it, and the next picture
/// waits for the copy; what has to be encoded goes to another thread. What waits there is not
/// overtaken.
void FrameService::draw(FrameJob job, std::function<void(Encoded)> done) {
  State& state = *state_;
  const auto drawing = std::make_shared<Drawing>(Drawing{std::move(job), {}, std::move(done)});
  const View& view = drawing->job.view;
  if (isReadyAsDrawn(drawing->job) && state.toEncode == 0) {
    return state.renderer->render(drawing->job.snapshot, view.camera, view.options, view.renderer,
                                  [drawing](std::future<render::Frame> frame) {
                                    drawing->frame = std::move(frame);
                                    drawing->done(replyTo(*drawing));
                                  });
  }
  ++state.toEncode;
  drawing->frame =
      state.renderer->render(drawing->job.snapshot, view.camera, view.options, view.renderer);
  state.thread.post([&state, drawing] {
    drawing->done(replyTo(*drawing));
    --state.toEncode;
  });
}

}  // namespace enfilade::server
