#include "server/frame_service.hpp"

#include <spdlog/spdlog.h>

#include "render/render_thread.hpp"
#include "server/work_thread.hpp"
#include "server/world_messages.hpp"

namespace enfilade::server {

namespace {

struct Drawing {
  FrameJob job;
  std::future<render::Frame> frame;
  std::function<void(Buffer)> done;
};

Buffer frameReply(Drawing& drawing) {
  const render::Frame frame = drawing.frame.get();
  std::vector<std::uint8_t> attachment;
  v1::ServerMessage reply;
  reply.set_reply_to(drawing.job.requestId);
  *reply.mutable_frame() =
      messageOf(frame, drawing.job.snapshot->time, drawing.job.request, attachment);
  reply.mutable_frame()->set_watch(drawing.job.watch);
  reply.mutable_frame()->set_dropped(drawing.job.dropped);
  if (drawing.job.seen) drawing.job.seen(reply.frame(), attachment);
  return encodeShared(reply, attachment);
}

}  // namespace

struct FrameService::State {
  std::unique_ptr<render::RenderThread> renderer;
  std::string deviceName, whyNone;
  bool software = false;
  WorkThread thread;

  Buffer reply(Drawing& drawing);
};

Buffer FrameService::State::reply(Drawing& drawing) {
  try {
    if (!renderer)
      return errorReply(drawing.job.requestId, errorOf(v1::ERROR_NO_RENDERER, whyNone));
    Buffer whole = frameReply(drawing);
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

FrameService::FrameService(std::shared_ptr<const scene::Scene> scene, const DrawingOptions& drawing)
    : state_(std::make_unique<State>()) {
  try {
    state_->renderer =
        std::make_unique<render::RenderThread>(std::move(scene), drawing.device, drawing.renderer);
    state_->deviceName = state_->renderer->deviceName();
    state_->software = state_->renderer->software();
    if (const std::string& note = state_->renderer->deviceNote(); !note.empty()) {
      spdlog::warn(note);
    }
  } catch (const render::RenderError& error) {
    if (drawing.asked()) throw;
    state_->whyNone = error.what();
    spdlog::warn("no pictures: {}", error.what());
  }
}

FrameService::~FrameService() {
  finish();
}

void FrameService::finish() {
  state_->thread.finish();
}

const std::string& FrameService::deviceName() const {
  return state_->deviceName;
}
bool FrameService::software() const {
  return state_->software;
}
const std::string& FrameService::whyNone() const {
  return state_->whyNone;
}

void FrameService::draw(FrameJob job, std::function<void(Buffer)> done) {
  const auto drawing = std::make_shared<Drawing>(Drawing{std::move(job), {}, std::move(done)});
  if (state_->renderer) {
    const View& view = drawing->job.view;
    drawing->frame =
        state_->renderer->render(drawing->job.snapshot, view.camera, view.options, view.renderer);
  }
  state_->thread.post([state = state_.get(), drawing] { drawing->done(state->reply(*drawing)); });
}

}  // namespace enfilade::server
