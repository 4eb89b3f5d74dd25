// Drives a script over a world in this process: as fast as it can, without sockets.
#pragma once

#include "protocol/clients/cpp/socket_driver.hpp"
#include "render/service/renderer.hpp"
#include "server/messages/tick_statistics.hpp"
#include "server/recording/recordable_world.hpp"

namespace enfilade::server {

class InProcessDriver : public protocol::ScriptDriver {
 public:
  /// `renderer` may be null: captures then have no picture. Both outlive the driver, which is used
  /// on the renderer's thread.
  InProcessDriver(RecordedWorld& world, render::Renderer* renderer,
                  protocol::CaptureFormat format = {});

  double tickSeconds() const override;
  std::optional<v1::Error> submit(const v1::Command& command) override;
  std::optional<v1::Error> submit(const v1::BodyCommand& command) override;
  protocol::StepOutcome step() override;

  /// A picture of the last tick. Throws protocol::ProtocolError, as over a connection.
  protocol::ReceivedFrame frame(const v1::FrameRequest& request);
  v1::Metrics metrics() const;
  /// Ends what contacts live; the world is not ticked after this.
  std::vector<v1::ContactEvent> endContacts();

 private:
  protocol::CapturedFrame capture(const v1::Notice& notice);
  void record(const std::string& avatar, const protocol::ReceivedFrame& taken);
  void recordPictures();

  RecordedWorld& world_;
  render::Renderer* renderer_;
  protocol::CaptureFormat format_;
  TickStatistics statistics_;
  std::uint64_t frames_ = 0;
};

}  // namespace enfilade::server
