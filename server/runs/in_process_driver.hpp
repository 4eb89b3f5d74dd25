// Runs a script on a world in this process, as fast as possible and without sockets.
#pragma once

#include <optional>

#include "protocol/clients/cpp/socket_driver.hpp"
#include "render/service/renderer_selector.hpp"
#include "server/messages/tick_statistics.hpp"
#include "server/navigation/navigation_service.hpp"
#include "server/recording/recordable_world.hpp"

namespace enfilade::server {

class InProcessDriver : public protocol::ScriptDriver {
 public:
  /// `renderer` may be null: captures then have no picture. Both outlive the driver. Use it on the
  /// renderer's thread.
  InProcessDriver(RecordableWorld& world, render::RendererSelector* renderer,
                  protocol::CaptureFormat format = {});

  double tickSeconds() const override;
  std::optional<v1::Error> submit(const v1::Command& command) override;
  std::optional<v1::Error> submit(const v1::BodyCommand& command) override;
  protocol::StepOutcome step() override;

  /// Renders the last tick. Throws protocol::ProtocolError, as a connection would.
  protocol::ReceivedFrame frame(const v1::FrameRequest& request);
  v1::Metrics metrics() const;
  /// Ends all active contacts. The world must not be ticked afterwards.
  std::vector<v1::ContactEvent> endContacts();

 private:
  protocol::CapturedFrame capture(const v1::Notice& notice);
  void record(const std::string& avatar, const protocol::ReceivedFrame& received);
  void recordImages();

  std::optional<v1::Error> go(const v1::Command& command);

  RecordableWorld& world_;
  render::RendererSelector* renderer_;
  protocol::CaptureFormat format_;
  TickStatistics statistics_;
  std::uint64_t frames_ = 0;
  std::optional<NavigationService> navigation_;  ///< from the first Go on
};

}  // namespace enfilade::server
