// A thread that owns the renderers and processes frame requests in order.
#pragma once

#include <functional>
#include <future>
#include <memory>
#include <vector>

#include "render/service/renderer_selector.hpp"

namespace enfilade::render {

/// Thread-safe front end of a RendererSelector.
class RenderThread {
 public:
  /// Starts the thread, which creates its RendererSelector on the first request. Throws
  /// RenderError without a scene.
  explicit RenderThread(std::shared_ptr<const scene::Scene> scene, DeviceChoice device = {},
                        RendererKind kind = RendererKind::automatic);
  ~RenderThread();  ///< finishes the queued requests
  RenderThread(const RenderThread&) = delete;
  RenderThread& operator=(const RenderThread&) = delete;

  /// The future delivers the frame or a RenderError; RendererUnavailable if no renderer could be
  /// created. Callable from any thread.
  std::future<Frame> render(std::shared_ptr<const scene::Snapshot> snapshot, Camera camera,
                            FrameOptions options = {}, RendererKind kind = RendererKind::automatic);
  /// Ready futures, one per view.
  using Frames = std::vector<std::future<Frame>>;
  /// As above, of several views together. Calls `done` on this object's thread, so that no thread
  /// has to wait. `done` must not throw.
  void render(std::vector<RenderRequest> requests, std::function<void(Frames)> done);
  // As in Renderer. These functions create the renderer if necessary and wait for it.
  const std::string& deviceName() const;  ///< "" without a renderer
  bool software() const;
  const std::string& deviceWarning() const;
  const std::string& unavailableReason() const;  ///< "" if there is a renderer

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace enfilade::render
