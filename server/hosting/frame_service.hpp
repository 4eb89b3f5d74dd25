// Pictures for clients: the render thread draws, a second thread encodes what has to be, so that
// neither the tick nor a socket ever waits for a picture.
#pragma once

#include <atomic>
#include <functional>
#include <memory>

#include "scene/world/data/scene.hpp"
#include "server/app/command_line.hpp"
#include "server/messages/frame_messages.hpp"
#include "server/messages/outgoing_queue.hpp"

namespace enfilade::server {

struct FrameJob {
  std::shared_ptr<const scene::Snapshot> snapshot;
  View view;
  v1::FrameRequest request;
  std::uint64_t requestId = 0;  ///< 0: nobody asked for this one; it is of a watch
  std::uint32_t watch = 0;      ///< 0: of none
  std::uint64_t dropped = 0;    ///< Frame.dropped
  std::shared_ptr<std::atomic<std::uint64_t>> drawn;  ///< counts it; may be null
  /// Gets the picture before the reply is made of it, on the service's thread; may be empty.
  std::function<void(const v1::Frame&, std::span<const std::uint8_t> attachment)> seen = {};
};

class FrameService {
 public:
  /// The renderer is made when it is first needed. Without a device there is none, which is no
  /// failure, unless `drawing` asked for something: then it is made now, and RenderError thrown.
  explicit FrameService(std::shared_ptr<const scene::Scene> scene,
                        const DrawingOptions& drawing = {});
  ~FrameService();
  FrameService(const FrameService&) = delete;
  FrameService& operator=(const FrameService&) = delete;

  /// Has the renderer made while the caller goes on, and logs what is wrong with it. Opening a
  /// device's driver takes longer than loading many a scene, and keeps whoever starts a thread
  /// waiting (glibc 2.36 locks the list of libraries for both): best when all threads run.
  void prepare();
  // As RenderThread's: they wait until it is made. Not after finish().
  const std::string& deviceName() const;
  bool software() const;
  const std::string& whyNone() const;

  /// `done` gets the whole reply (a Frame or an Error), in the order of the calls of one thread, on
  /// a thread of the service's. It must not throw.
  void draw(FrameJob job, std::function<void(Encoded)> done);
  /// Waits for what was asked; nothing may be asked afterwards.
  void finish();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace enfilade::server
