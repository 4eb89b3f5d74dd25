#include "server/frame_service.hpp"

#include <spdlog/spdlog.h>

#include <atomic>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>

#include "protocol/framing.hpp"
#include "render/render_thread.hpp"
#include "server/world_messages.hpp"

namespace enfilade::server {

namespace {

struct Drawing {
  FrameJob job;
  std::future<render::Frame> frame;
  std::function<void(Buffer)> done;
};

Buffer encoded(const v1::ServerMessage& message, std::span<const std::uint8_t> attachment = {}) {
  return std::make_shared<const std::vector<std::uint8_t>>(protocol::encode(message, attachment));
}

Buffer errorReply(std::uint64_t requestId, v1::ErrorCode code, const std::string& text) {
  v1::ServerMessage reply;
  reply.set_reply_to(requestId);
  *reply.mutable_error() = errorOf(code, text);
  return encoded(reply);
}

Buffer frameReply(Drawing& drawing) {
  const render::Frame frame = drawing.frame.get();
  std::vector<std::uint8_t> attachment;
  v1::ServerMessage reply;
  reply.set_reply_to(drawing.job.requestId);
  *reply.mutable_frame() =
      messageOf(frame, drawing.job.snapshot->time, drawing.job.request, attachment);
  return encoded(reply, attachment);
}

}  // namespace

struct FrameService::State {
  std::unique_ptr<render::RenderThread> renderer;
  std::string deviceName, whyNone;
  bool software = false;
  std::atomic<std::uint64_t> drawn{0};
  std::mutex mutex;
  std::condition_variable changed;
  std::deque<Drawing> drawings;
  bool finishing = false;
  std::thread thread;

  void run();
  Buffer reply(Drawing& drawing);
};

Buffer FrameService::State::reply(Drawing& drawing) {
  try {
    if (!renderer) return errorReply(drawing.job.requestId, v1::ERROR_NO_RENDERER, whyNone);
    Buffer whole = frameReply(drawing);
    ++drawn;
    return whole;
  } catch (const std::exception& error) {
    spdlog::error("a picture could not be made: {}", error.what());
    return errorReply(drawing.job.requestId, v1::ERROR_INTERNAL, error.what());
  }
}

void FrameService::State::run() {
  for (;;) {
    std::unique_lock lock(mutex);
    changed.wait(lock, [this] { return finishing || !drawings.empty(); });
    if (drawings.empty()) return;
    Drawing drawing = std::move(drawings.front());
    drawings.pop_front();
    lock.unlock();
    drawing.done(reply(drawing));
  }
}

FrameService::FrameService(std::shared_ptr<const scene::Scene> scene)
    : state_(std::make_unique<State>()) {
  try {
    state_->renderer = std::make_unique<render::RenderThread>(std::move(scene));
    state_->deviceName = state_->renderer->deviceName();
    state_->software = state_->renderer->software();
  } catch (const render::RenderError& error) {
    state_->whyNone = error.what();
    spdlog::warn("no pictures: {}", error.what());
  }
  state_->thread = std::thread([state = state_.get()] { state->run(); });
}

FrameService::~FrameService() {
  finish();
}

void FrameService::finish() {
  {
    const std::lock_guard lock(state_->mutex);
    state_->finishing = true;
  }
  state_->changed.notify_one();
  if (state_->thread.joinable()) state_->thread.join();
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
std::uint64_t FrameService::drawn() const {
  return state_->drawn;
}

void FrameService::draw(FrameJob job, std::function<void(Buffer)> done) {
  Drawing drawing{std::move(job), {}, std::move(done)};
  if (state_->renderer) {
    const View& view = drawing.job.view;
    drawing.frame = state_->renderer->render(drawing.job.snapshot, view.camera, view.hidden);
  }
  {
    const std::lock_guard lock(state_->mutex);
    state_->drawings.push_back(std::move(drawing));
  }
  state_->changed.notify_one();
}

}  // namespace enfilade::server
