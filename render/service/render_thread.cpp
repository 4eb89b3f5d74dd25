#include "render/service/render_thread.hpp"

#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>
#include <utility>

namespace enfilade::render {

struct RenderThread::State {
  struct Job {
    std::vector<RenderRequest> requests;
    std::function<void(Frames)> done;
  };

  std::mutex mutex;
  std::condition_variable changed;
  std::deque<Job> jobs;
  bool requested = false, closing = false;
  std::promise<void> creationPromise;
  std::shared_future<void> creationDone = creationPromise.get_future().share();
  std::string deviceName, deviceWarning, unavailableReason;  ///< valid after creationDone
  bool software = false;
  std::thread thread;

  /// False if the thread is closed without any request.
  bool waitForFirstRequest() {
    std::unique_lock lock(mutex);
    changed.wait(lock, [&] { return closing || requested || !jobs.empty(); });
    return requested || !jobs.empty();
  }

  /// Requests the renderer's creation and waits for it.
  const State& waitUntilCreated() {
    {
      const std::lock_guard lock(mutex);
      requested = true;
    }
    changed.notify_one();
    creationDone.wait();
    return *this;
  }

  /// nullopt if the queue is empty and closed.
  std::optional<Job> takeJob() {
    std::unique_lock lock(mutex);
    changed.wait(lock, [&] { return closing || !jobs.empty(); });
    if (jobs.empty()) return std::nullopt;
    Job job = std::move(jobs.front());
    jobs.pop_front();
    return job;
  }

  void enqueue(Job job) {
    {
      const std::lock_guard lock(mutex);
      jobs.push_back(std::move(job));
    }
    changed.notify_one();
  }

  /// Null if no renderer is available.
  std::unique_ptr<RendererSelector> createRenderer(std::shared_ptr<const scene::Scene> scene,
                                                   const DeviceChoice& device, RendererKind kind) {
    std::unique_ptr<RendererSelector> renderer;
    try {
      renderer = std::make_unique<RendererSelector>(std::move(scene), kind, device);
      deviceName = renderer->deviceName();
      deviceWarning = renderer->deviceWarning();
      software = renderer->software();
    } catch (const std::exception& error) {
      unavailableReason = error.what();
    }
    creationPromise.set_value();
    return renderer;
  }

  void run(std::shared_ptr<const scene::Scene> scene, const DeviceChoice& device,
           RendererKind kind) {
    if (!waitForFirstRequest()) return;
    const std::unique_ptr<RendererSelector> renderer =
        createRenderer(std::move(scene), device, kind);
    while (auto job = takeJob()) job->done(renderAll(renderer.get(), job->requests));
  }

  std::vector<Frame> renderTogether(RendererSelector* renderer,
                                    std::span<const RenderRequest> requests) const {
    if (!renderer) throw RendererUnavailable(unavailableReason);
    return renderer->render(requests);
  }

  Frames renderAll(RendererSelector* renderer, std::span<const RenderRequest> requests) const {
    Frames frames;
    try {
      for (Frame& frame : renderTogether(renderer, requests)) {
        std::promise<Frame> promise;
        promise.set_value(std::move(frame));
        frames.push_back(promise.get_future());
      }
    } catch (...) {
      if (requests.size() == 1) {
        std::promise<Frame> promise;
        promise.set_exception(std::current_exception());
        frames.push_back(promise.get_future());
        return frames;
      }
      // One by one, so that an error concerns only its own view.
      for (const RenderRequest& request : requests)
        frames.push_back(std::move(renderAll(renderer, std::span(&request, 1)).front()));
    }
    return frames;
  }
};

RenderThread::RenderThread(std::shared_ptr<const scene::Scene> scene, DeviceChoice device,
                           RendererKind kind)
    : state_(std::make_unique<State>()) {
  if (!scene) throw RenderError("RenderThread: no scene");
  state_->thread =
      std::thread(&State::run, state_.get(), std::move(scene), std::move(device), kind);
}

RenderThread::~RenderThread() {
  {
    const std::lock_guard lock(state_->mutex);
    state_->closing = true;
  }
  state_->changed.notify_one();
  state_->thread.join();
}

std::future<Frame> RenderThread::render(std::shared_ptr<const scene::Snapshot> snapshot,
                                        Camera camera, FrameOptions options, RendererKind kind) {
  const auto promise = std::make_shared<std::promise<Frame>>();
  render({{std::move(snapshot), {std::move(camera), options, kind}}}, [promise](Frames frames) {
    try {
      promise->set_value(frames.front().get());
    } catch (...) {
      promise->set_exception(std::current_exception());
    }
  });
  return promise->get_future();
}

void RenderThread::render(std::vector<RenderRequest> requests, std::function<void(Frames)> done) {
  state_->enqueue({std::move(requests), std::move(done)});
}

const std::string& RenderThread::deviceName() const {
  return state_->waitUntilCreated().deviceName;
}
const std::string& RenderThread::deviceWarning() const {
  return state_->waitUntilCreated().deviceWarning;
}
const std::string& RenderThread::unavailableReason() const {
  return state_->waitUntilCreated().unavailableReason;
}
bool RenderThread::software() const {
  return state_->waitUntilCreated().software;
}

}  // namespace enfilade::render
