// Drives a script over a connection, in lockstep.
#pragma once

#include <set>
#include <string>

#include "protocol/clients/cpp/client.hpp"
#include "protocol/script/script.hpp"

namespace enfilade::protocol {

/// What pictures a script's captures are.
struct CaptureFormat {
  std::uint32_t width = 640, height = 480;  ///< pixels
  std::vector<v1::Channel> channels{v1::CHANNEL_RGB};
  v1::Encoding rgbEncoding = v1::ENCODING_RAW;
};

class SocketDriver : public ScriptDriver {
 public:
  /// Takes the clock and subscribes to contacts and notices. `client` outlives the driver. Throws
  /// ProtocolError when another client drives.
  explicit SocketDriver(Client& client, CaptureFormat format = {});

  double tickSeconds() const override;
  std::optional<v1::Error> submit(const v1::Command& command) override;
  std::optional<v1::Error> submit(const v1::BodyCommand& command) override;
  StepOutcome step() override;

 private:
  CapturedFrame capture(const v1::Notice& notice);
  bool concerns(const v1::ContactEvent& contact) const;

  Client& client_;
  CaptureFormat format_;
  std::set<std::string> avatars_;  ///< that this script commands
};

/// What to ask for when `notice` says that a capture is due.
v1::FrameRequest captureRequest(const v1::Notice& notice, const CaptureFormat& format);

}  // namespace enfilade::protocol
