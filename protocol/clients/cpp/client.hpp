// A blocking client of one server. Not thread-safe.
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

/// The connection failed, broke or timed out. The text has host:port and a remedy. The client
/// cannot be used any more.
struct ConnectionError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The server replied with an error or with an invalid message.
struct ProtocolError : std::runtime_error {
  ProtocolError(v1::ErrorCode errorCode, const std::string& message, std::string errorField = {});
  v1::ErrorCode code;
  std::string field;  ///< the field that the server rejected; may be empty
};

struct ClientOptions {
  std::string name = "enfilade client";
  std::string token;  ///< for servers that require one
  std::string world;  ///< the world to join; empty: the main world
  /// Wall-clock limit for connecting and for each reply. A step's reply comes after all its ticks:
  /// use fewer ticks per step or a longer timeout if they take longer.
  std::chrono::milliseconds timeout{30'000};
  FramingLimits limits = kClientLimits;
};

struct ReceivedFrame {
  v1::Frame description;
  std::vector<std::uint8_t> pixels;

  /// The bytes of one channel in the format of Plane; empty if the channel was not requested.
  std::span<const std::uint8_t> plane(v1::Channel channel) const;
};

/// A scan: rows from top to bottom, each from left to right.
struct ReceivedScan {
  std::vector<float> distances;         ///< metres along each ray; NaN: no hit
  std::vector<std::uint32_t> entities;  ///< 0: no hit
};

class Client {
 public:
  /// Connects and exchanges hello and welcome. Throws ConnectionError or ProtocolError
  /// (ERROR_VERSION).
  Client(const std::string& host, std::uint16_t port, const ClientOptions& options = {});
  ~Client();  ///< sends Bye
  Client(Client&&) noexcept;
  Client& operator=(Client&&) noexcept;

  const v1::Welcome& welcome() const;

  /// Returns the world's reason for refusing the command; nullopt if accepted.
  std::optional<v1::Error> command(const v1::Command& command);
  std::optional<v1::Error> bodyCommand(const v1::BodyCommand& command);
  v1::StepReply step(std::uint32_t ticks = 1, bool withAvatars = false);
  v1::SetClockReply setClock(const v1::SetClock& clock);
  /// Seeks in a world that plays a recording. Events for contacts that end and begin arrive before
  /// the reply.
  v1::SeekReply seek(std::uint64_t tick);
  /// Makes `avatar` the client's. Empty: only the world leaves the recording.
  v1::TakeOverReply takeOver(const std::string& avatar = {});
  v1::SubscribeReply subscribe(const v1::Subscribe& subscription);
  ReceivedFrame frame(const v1::FrameRequest& request);
  /// `scan` receives the attachment if a scan was requested.
  v1::RayReply rays(const v1::RayQuery& query, ReceivedScan* scan = nullptr);
  v1::DistanceReply distances(const v1::DistanceQuery& query);
  v1::TouchingReply touching(const v1::TouchingQuery& query);
  v1::CannotTouchReply cannotTouch(const v1::CannotTouchQuery& query);
  v1::FloorPlan floorPlan(double floor);
  std::vector<v1::Entity> describe(std::span<const std::uint32_t> ids);
  v1::Metrics metrics();

  /// Events in order: TickEvents, State, Replay or Bye. They are kept until taken. takeEvents()
  /// returns the events before the last reply without blocking; nextEvent() waits up to `timeout`.
  /// After a Bye the connection is broken, and the next call throws.
  std::deque<v1::ServerMessage> takeEvents();
  std::optional<v1::ServerMessage> nextEvent(std::chrono::milliseconds timeout);

  /// Sends any request. The caller checks the type of the reply. Throws ProtocolError for an Error.
  v1::ServerMessage request(v1::ClientMessage message,
                            std::vector<std::uint8_t>* attachment = nullptr);

 private:
  /// Sends a command and returns the reason if it was refused.
  std::optional<v1::Error> sendCommand(v1::ClientMessage message);
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace enfilade::protocol
