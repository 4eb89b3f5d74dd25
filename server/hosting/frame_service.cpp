#include "server/hosting/frame_service.hpp"

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <future>
#include <iterator>
#include <mutex>
#include <optional>
#include <utility>

#include "render/service/render_thread.hpp"
#include "server/base/work_thread.hpp"
#include "server/log/log.hpp"
#include "server/messages/frame_encoding.hpp"
#include "server/messages/world_messages.hpp"

namespace enfilade::server {

namespace {

struct PendingFrame {
  FrameJob job;
  std::future<render::Frame> frame;
  std::function<void(EncodedMessage)> done;
};

EncodedMessage encodeFrameReply(PendingFrame& pending, const scene::Scene& scene) {
  const render::Frame frame = pending.frame.get();
  std::vector<std::uint8_t> attachment;
  v1::ServerMessage reply;
  reply.set_reply_to(pending.job.requestId);
  const FrameJob& job = pending.job;
  *reply.mutable_frame() =
      encodeFrame(frame, {job.request, scene, *job.snapshot, job.earlier ? &*job.earlier : nullptr},
                  attachment);
  reply.mutable_frame()->set_watch(pending.job.subscription);
  reply.mutable_frame()->set_dropped(pending.job.dropped);
  if (pending.job.onRendered) pending.job.onRendered(reply.frame(), attachment);
  return encodeShared(reply, std::move(attachment));
}

}  // namespace

namespace {

/// Frames that are rendered together, of any worlds of the scene.
using FrameGroup = std::vector<PendingFrame>;

/// Frames that wait to be rendered. Owners take turns; one owner's frames keep their order.
class FrameTurns {
 public:
  void push(PendingFrame pending) {
    const void* owner = pending.job.owner.get();
    auto queue = std::find_if(queues_.begin(), queues_.end(),
                              [&](const OwnerQueue& one) { return one.owner == owner; });
    if (queue == queues_.end()) queue = queues_.insert(queues_.end(), OwnerQueue{owner, {}});
    queue->frames.push_back(std::move(pending));
  }
  /// The next frame, and the next frames of all owners up to a number of pixels; empty: none waits.
  /// The owners that had their turn go to the end.
  FrameGroup pop() {
    FrameGroup group;
    std::size_t pixels = 0;
    const auto joins = [&](const PendingFrame& frame) {
      const std::size_t sum = pixels + render::countPixels(frame.job.view.camera);
      if (!group.empty() && sum > render::kMaxPixelsTogether) return false;
      pixels = sum;
      return true;
    };
    std::deque<OwnerQueue> waiting, served;
    for (OwnerQueue& queue : queues_) {
      const std::size_t before = group.size();
      while (!queue.frames.empty() && joins(queue.frames.front())) {
        group.push_back(std::move(queue.frames.front()));
        queue.frames.pop_front();
      }
      if (!queue.frames.empty())
        (group.size() > before ? served : waiting).push_back(std::move(queue));
    }
    queues_ = std::move(waiting);
    std::ranges::move(served, std::back_inserter(queues_));
    return group;
  }
  void cancel(const void* owner) {
    for (OwnerQueue& queue : queues_)
      if (queue.owner == owner)
        std::erase_if(queue.frames, [](const PendingFrame& one) { return !one.job.onRendered; });
    std::erase_if(queues_, [](const OwnerQueue& queue) { return queue.frames.empty(); });
  }
  bool empty() const { return queues_.empty(); }

 private:
  struct OwnerQueue {
    const void* owner = nullptr;
    std::deque<PendingFrame> frames;  ///< not empty
  };
  std::deque<OwnerQueue> queues_;
};

}  // namespace

struct FrameService::State {
  std::shared_ptr<const scene::Scene> scene;
  std::mutex mutex;  ///< guards the next three
  FrameTurns waiting;
  bool rendering = false;
  std::condition_variable idle;
  std::atomic<int> pendingEncodes = 0;  ///< frames queued for encoding on `thread`
  WorkThread thread;
  std::unique_ptr<render::RenderThread> renderer;  // destroyed first: it may still call back

  void startNext();
  void deliver(const std::shared_ptr<PendingFrame>& pending);
};

namespace {

EncodedMessage makeReply(PendingFrame& pending, const scene::Scene& scene) {
  try {
    EncodedMessage encoded = encodeFrameReply(pending, scene);
    if (pending.job.renderedCount) ++*pending.job.renderedCount;
    return encoded;
  } catch (const render::RendererUnavailable& error) {
    return makeErrorReply(pending.job.requestId,
                          makeError(v1::ERROR_NO_RENDERER, error.what(), "renderer"));
  } catch (const std::exception& error) {
    logError("cannot render a frame: {}", error.what());
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
  state_->scene = scene;
  state_->renderer =
      std::make_unique<render::RenderThread>(std::move(scene), drawing.device, drawing.renderer);
  if (drawing.isRequested() && !unavailableReason().empty())
    throw render::RenderError(unavailableReason());
}

FrameService::~FrameService() {
  finish();
}

void FrameService::finish() {
  {
    std::unique_lock lock(state_->mutex);
    state_->idle.wait(lock, [&] { return !state_->rendering && state_->waiting.empty(); });
  }
  state_->thread.finish();
  state_->renderer.reset();
}

void FrameService::prepare() {
  state_->thread.post([&renderer = *state_->renderer] {
    if (!renderer.unavailableReason().empty())
      return logWarning("no frames: {}", renderer.unavailableReason());
    if (!renderer.deviceWarning().empty()) logWarning("{}", renderer.deviceWarning());
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
void FrameService::State::deliver(const std::shared_ptr<PendingFrame>& pending) {
  if (isCheapReply(pending->job) && pendingEncodes == 0)
    return pending->done(makeReply(*pending, *scene));
  ++pendingEncodes;
  thread.post([this, pending] {
    pending->done(makeReply(*pending, *scene));
    --pendingEncodes;
  });
}

/// Gives the next frames to the render thread, unless it has some.
void FrameService::State::startNext() {
  const auto group = std::make_shared<FrameGroup>();
  {
    const std::lock_guard lock(mutex);
    if (rendering) return;
    *group = waiting.pop();
    if (group->empty()) return idle.notify_all();
    rendering = true;
  }
  std::vector<render::RenderRequest> requests;
  for (const PendingFrame& pending : *group)
    requests.push_back({pending.job.snapshot, pending.job.view});
  renderer->render(std::move(requests), [this, group](render::RenderThread::Frames frames) {
    for (std::size_t i = 0; i < frames.size(); ++i) {
      (*group)[i].frame = std::move(frames[i]);
      deliver(std::make_shared<PendingFrame>(std::move((*group)[i])));
    }
    {
      const std::lock_guard lock(mutex);
      rendering = false;
    }
    startNext();
  });
}

void FrameService::renderFrame(FrameJob job, std::function<void(EncodedMessage)> done) {
  {
    const std::lock_guard lock(state_->mutex);
    state_->waiting.push({std::move(job), {}, std::move(done)});
  }
  state_->startNext();
}

void FrameService::cancel(const std::shared_ptr<const void>& owner) {
  const std::lock_guard lock(state_->mutex);
  state_->waiting.cancel(owner.get());
}

}  // namespace enfilade::server
