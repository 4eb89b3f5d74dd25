#include "render/service/render_thread.hpp"

#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>
#include <utility>

namespace enfilade::render {

struct RenderThread::State {
  struct Job {
    std::shared_ptr<const scene::Snapshot> snapshot;
    std::vector<ViewRequest> views;
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
    while (auto job = takeJob()) job->done(renderAll(renderer.get(), *job));
  }

  std::vector<Frame> renderTogether(RendererSelector* renderer, const Job& job,
                                    std::span<const ViewRequest> views) const {
    if (!renderer) throw RendererUnavailable(unavailableReason);
    if (!job.snapshot) throw RenderError("RenderThread::render: no snapshot");
    return renderer->render(*job.snapshot, views);
  }

  Frames renderAll(RendererSelector* renderer, const Job& job) const {
    Frames frames;
    try {
      for (Frame& frame : renderTogether(renderer, job, job.views)) {
        std::promise<Frame> promise;
        promise.set_value(std::move(frame));
        frames.push_back(promise.get_future());
      }
    } catch (...) {
      if (job.views.size() == 1) {
        std::promise<Frame> promise;
        promise.set_exception(std::current_exception());
        frames.push_back(promise.get_future());
        return frames;
      }
      // One by one, so that an error concerns only its own view.
      for (const ViewRequest& view : job.views)
        frames.push_back(std::move(renderAll(renderer, {job.snapshot, {view}, {}}).front()));
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
  render(std::move(snapshot), {{std::move(camera), options, kind}}, [promise](Frames frames) {
    try {
      promise->set_value(frames.front().get());
    } catch (...) {
      promise->set_exception(std::current_exception());
    }
  });
  return promise->get_future();
}

void RenderThread::render(std::shared_ptr<const scene::Snapshot> snapshot,
                          std::vector<ViewRequest> views, std::function<void(Frames)> done) {
  state_->enqueue({std::move(snapshot), std::move(views), std::move(done)});
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
