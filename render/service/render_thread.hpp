// One thread that owns the renderers and draws what is asked, in order.
#pragma once

#include <functional>
#include <future>
#include <memory>

#include "render/service/renderer.hpp"

namespace enfilade::render {

class RenderThread {
 public:
  /// Starts the thread, which makes its Renderer when it is first asked for anything. Throws
  /// RenderError without a scene.
  explicit RenderThread(std::shared_ptr<const scene::Scene> scene, DeviceChoice device = {},
                        RendererKind kind = RendererKind::automatic);
  ~RenderThread();  ///< finishes what is queued
  RenderThread(const RenderThread&) = delete;
  RenderThread& operator=(const RenderThread&) = delete;

  /// The frame, or the RenderError, comes through the future; NoRenderer when there can be none.
  /// Callable from any thread.
  std::future<Frame> render(std::shared_ptr<const scene::Snapshot> snapshot, Camera camera,
                            FrameOptions options = {}, RendererKind kind = RendererKind::automatic);
  /// As render(), but the future is given when it is ready, on this object's thread, so that nobody
  /// has to be woken. `done` must not throw.
  void render(std::shared_ptr<const scene::Snapshot> snapshot, Camera camera, FrameOptions options,
              RendererKind kind, std::function<void(std::future<Frame>)> done);
  // As Renderer's. They have it made, and wait for it.
  const std::string& deviceName() const;  ///< "" when there can be none
  bool software() const;
  const std::string& deviceNote() const;
  const std::string& whyNone() const;  ///< "" with a renderer

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace enfilade::render
