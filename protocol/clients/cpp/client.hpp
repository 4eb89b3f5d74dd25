// A blocking client of one server. Not for use from two threads at once.
#pragma once

#include <chrono>
#include <deque>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "protocol/enfilade.pb.h"
#include "protocol/framing.hpp"

namespace enfilade::protocol {

/// The connection could not be made, broke or fell silent. Names host:port and what to try. The
/// client is of no more use.
struct ConnectionError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The server answered a request with an error, or with something that makes no sense.
struct ProtocolError : std::runtime_error {
  ProtocolError(v1::ErrorCode errorCode, const std::string& message, std::string errorField = {});
  v1::ErrorCode code;
  std::string field;  ///< what the server complained about, may be empty
};

struct ClientOptions {
  std::string name = "enfilade client";
  std::string token;  ///< for servers that want one
  std::string world;  ///< that it enters; empty: the main one
  /// Of connecting, and of each reply (wall-clock time): a step's reply comes after all its ticks,
  /// so ask for fewer at a time, or give more time, where they take longer.
  std::chrono::milliseconds timeout{30'000};
  FramingLimits limits = kClientTakes;
};

struct ReceivedFrame {
  v1::Frame description;
  std::vector<std::uint8_t> pixels;

  /// The bytes of one channel, as Plane tells them; empty when it was not asked for.
  std::span<const std::uint8_t> plane(v1::Channel channel) const;
};

/// Row by row from above, each from the left.
struct ReceivedScan {
  std::vector<float> distances;         ///< metres along each ray, NaN: nothing was met
  std::vector<std::uint32_t> entities;  ///< 0: nothing was met
};

class Client {
 public:
  /// Connects and greets. Throws ConnectionError, or ProtocolError (ERROR_VERSION).
  Client(const std::string& host, std::uint16_t port, const ClientOptions& options = {});
  ~Client();  ///< says Bye
  Client(Client&&) noexcept;
  Client& operator=(Client&&) noexcept;

  const v1::Welcome& welcome() const;

  /// Why the world does not take it; nullopt when it does.
  std::optional<v1::Error> command(const v1::Command& command);
  std::optional<v1::Error> bodyCommand(const v1::BodyCommand& command);
  v1::StepReply step(std::uint32_t ticks = 1, bool withAvatars = false);
  v1::SetClockReply setClock(const v1::SetClock& clock);
  /// Of a world that plays a recording. Contacts that end and begin by it are events that come
  /// before the reply.
  v1::SeekReply seek(std::uint64_t tick);
  /// `avatar`: that becomes the client's; empty: none, the world alone leaves the recording.
  v1::TakeOverReply takeOver(const std::string& avatar = {});
  v1::SubscribeReply subscribe(const v1::Subscribe& subscription);
  ReceivedFrame frame(const v1::FrameRequest& request);
  /// `scan` gets what the attachment holds when a scan was asked for.
  v1::RayReply rays(const v1::RayQuery& query, ReceivedScan* scan = nullptr);
  v1::DistanceReply distances(const v1::DistanceQuery& query);
  v1::TouchingReply touching(const v1::TouchingQuery& query);
  v1::CannotTouchReply cannotTouch(const v1::CannotTouchQuery& query);
  std::vector<v1::Entity> describe(std::span<const std::uint32_t> ids);
  v1::Metrics metrics();

  /// What came unasked, in order: TickEvents, State, Replay or Bye. takeEvents() gives what came
  /// before the last reply and does not wait; nextEvent() waits up to `patience` for one. They are
  /// kept until taken. After Bye the connection is broken, and the next call says so.
  std::deque<v1::ServerMessage> takeEvents();
  std::optional<v1::ServerMessage> nextEvent(std::chrono::milliseconds patience);

  /// Any request; the reply's body is the caller's to check. Throws ProtocolError for Error.
  v1::ServerMessage request(v1::ClientMessage message,
                            std::vector<std::uint8_t>* attachment = nullptr);

 private:
  /// Sends a command; why it was not taken.
  std::optional<v1::Error> tell(v1::ClientMessage message);
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace enfilade::protocol
