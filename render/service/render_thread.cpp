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
    Camera camera;
    FrameOptions options;
    RendererKind kind;
    std::promise<Frame> frame;
    std::function<void(std::future<Frame>)> done;  ///< may be empty
  };

  std::mutex mutex;
  std::condition_variable changed;
  std::deque<Job> jobs;
  bool asked = false, closing = false;
  std::promise<void> making;
  std::shared_future<void> isMade = making.get_future().share();
  std::string deviceName, deviceNote, whyNone;  ///< once isMade, as the next
  bool software = false;
  std::thread thread;

  /// False when nothing was asked before the end.
  bool awaitFirstQuestion() {
    std::unique_lock lock(mutex);
    changed.wait(lock, [&] { return closing || asked || !jobs.empty(); });
    return asked || !jobs.empty();
  }

  /// Has the renderer made, and waits for it.
  const State& made() {
    {
      const std::lock_guard lock(mutex);
      asked = true;
    }
    changed.notify_one();
    isMade.wait();
    return *this;
  }

  /// nullopt when the queue is empty and no more will come.
  std::optional<Job> nextJob() {
    std::unique_lock lock(mutex);
    changed.wait(lock, [&] { return closing || !jobs.empty(); });
    if (jobs.empty()) return std::nullopt;
    Job job = std::move(jobs.front());
    jobs.pop_front();
    return job;
  }

  void post(Job job) {
    {
      const std::lock_guard lock(mutex);
      jobs.push_back(std::move(job));
    }
    changed.notify_one();
  }

  /// Null when there can be none.
  std::unique_ptr<Renderer> make(std::shared_ptr<const scene::Scene> scene,
                                 const DeviceChoice& device, RendererKind kind) {
    std::unique_ptr<Renderer> renderer;
    try {
      renderer = std::make_unique<Renderer>(std::move(scene), kind, device);
      deviceName = renderer->deviceName();
      deviceNote = renderer->deviceNote();
      software = renderer->software();
    } catch (const std::exception& error) {
      whyNone = error.what();
    }
    making.set_value();
    return renderer;
  }

  void run(std::shared_ptr<const scene::Scene> scene, const DeviceChoice& device,
           RendererKind kind) {
    if (!awaitFirstQuestion()) return;
    const std::unique_ptr<Renderer> renderer = make(std::move(scene), device, kind);
    while (auto job = nextJob()) {
      try {
        if (!renderer) throw NoRenderer(whyNone);
        if (!job->snapshot) throw RenderError("RenderThread::render: there is no snapshot");
        job->frame.set_value(
            renderer->render(*job->snapshot, job->camera, job->options, job->kind));
      } catch (...) {
        job->frame.set_exception(std::current_exception());
      }
      if (job->done) job->done(job->frame.get_future());
    }
  }
};

RenderThread::RenderThread(std::shared_ptr<const scene::Scene> scene, DeviceChoice device,
                           RendererKind kind)
    : state_(std::make_unique<State>()) {
  if (!scene) throw RenderError("RenderThread: there is no scene");
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
  State::Job job{std::move(snapshot), std::move(camera), options, kind, {}, {}};
  std::future<Frame> frame = job.frame.get_future();
  state_->post(std::move(job));
  return frame;
}

void RenderThread::render(std::shared_ptr<const scene::Snapshot> snapshot, Camera camera,
                          FrameOptions options, RendererKind kind,
                          std::function<void(std::future<Frame>)> done) {
  state_->post({std::move(snapshot), std::move(camera), options, kind, {}, std::move(done)});
}

const std::string& RenderThread::deviceName() const {
  return state_->made().deviceName;
}
const std::string& RenderThread::deviceNote() const {
  return state_->made().deviceNote;
}
const std::string& RenderThread::whyNone() const {
  return state_->made().whyNone;
}
bool RenderThread::software() const {
  return state_->made().software;
}

}  // namespace enfilade::render
