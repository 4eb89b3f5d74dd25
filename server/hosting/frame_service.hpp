// Renders frames for clients, who take turns. One thread renders and a second one encodes, so that
// neither the tick nor the network thread waits for a frame.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <optional>

#include "scene/world/data/scene.hpp"
#include "server/base/drawing_options.hpp"
#include "server/messages/frame_messages.hpp"
#include "server/messages/outgoing_queue.hpp"

namespace enfilade::server {

/// A frame to render, and the destination of its reply.
struct FrameJob {
  std::shared_ptr<const scene::Snapshot> snapshot;
  render::ViewRequest view;
  v1::FrameRequest request;
  /// Owners take turns, so that one with many large frames does not delay the others. Unique per
  /// client of all worlds; null: the recordings.
  std::shared_ptr<const void> owner = nullptr;
  std::uint64_t requestId = 0;     ///< 0: the frame belongs to a subscription
  std::uint32_t subscription = 0;  ///< number of the subscription; 0: none
  std::uint64_t dropped = 0;       ///< Frame.dropped
  /// Incremented per frame; may be null.
  std::shared_ptr<std::atomic<std::uint64_t>> renderedCount;
  /// Receives the frame before its reply is encoded, on a thread of the service; may be empty.
  std::function<void(const v1::Frame&, std::span<const std::uint8_t> attachment)> onRendered = {};
  std::optional<EarlierView> earlier = std::nullopt;  ///< for the flow channel
};

class FrameService {
 public:
  /// The renderer is created at first use. A missing device is no error, unless `drawing` requests
  /// a device or renderer: then it is created now, and RenderError is thrown.
  explicit FrameService(std::shared_ptr<const scene::Scene> scene,
                        const DrawingOptions& drawing = {});
  ~FrameService();
  FrameService(const FrameService&) = delete;
  FrameService& operator=(const FrameService&) = delete;

  /// Creates the renderer in the background and logs its problems. Call it after all threads have
  /// started. Opening a driver can take seconds, and in glibc 2.36 it blocks the start of threads:
  /// both take the lock of the library list.
  void prepare();
  // These wait until the renderer is created. Do not call them after finish().
  const std::string& deviceName() const;
  bool isSoftware() const;
  const std::string& unavailableReason() const;

  /// `done` receives the encoded reply (a Frame or an Error) on a thread of the service, in the
  /// order of the calls for one owner. It must not throw.
  void renderFrame(FrameJob job, std::function<void(EncodedMessage)> done);
  /// Drops the owner's frames that wait for their turn, without calling `done`. Frames that are
  /// also recorded stay.
  void cancel(const std::shared_ptr<const void>& owner);
  /// Waits for all frames. Do not request frames afterwards.
  void finish();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace enfilade::server
