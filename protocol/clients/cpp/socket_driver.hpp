// Runs a script over a connection, in lockstep with the server's ticks.
#pragma once

#include <functional>
#include <set>
#include <string>

#include "protocol/clients/cpp/client.hpp"
#include "protocol/script/script_run.hpp"

namespace enfilade::protocol {

/// The format of a script's captures.
struct CaptureFormat {
  std::uint32_t width = 640, height = 480;  ///< pixels
  std::vector<v1::Channel> channels{v1::CHANNEL_RGB};
  v1::Encoding rgbEncoding = v1::ENCODING_RAW;
  std::uint32_t samples = 1;  ///< of the colour in each pixel
};

class SocketDriver : public ScriptDriver {
 public:
  /// Takes control of the clock and subscribes to contacts and notices. `client` outlives the
  /// driver. Throws ProtocolError if another client controls the clock.
  explicit SocketDriver(Client& client, CaptureFormat format = {});

  double tickSeconds() const override;
  std::optional<v1::Error> submit(const v1::Command& command) override;
  std::optional<v1::Error> submit(const v1::BodyCommand& command) override;
  StepOutcome step() override;

 private:
  bool concerns(const v1::ContactEvent& contact) const;

  Client& client_;
  CaptureFormat format_;
  std::set<std::string> avatars_;  ///< avatars of this script
};

/// Makes the frame request for a capture notice.
v1::FrameRequest makeCaptureRequest(const v1::Notice& notice, const CaptureFormat& format);
/// Requests the picture of a capture notice from `frame`, whose ProtocolError becomes
/// CapturedFrame::error.
CapturedFrame captureFrame(const v1::Notice& notice, const CaptureFormat& format,
                           const std::function<ReceivedFrame(const v1::FrameRequest&)>& frame);

}  // namespace enfilade::protocol
