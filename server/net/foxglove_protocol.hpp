// Messages of the Foxglove WebSocket protocol (foxglove.websocket.v1, foxglove.sdk.v1): what the
// server sends, and what it accepts. No sockets.
//
// Source: https://github.com/foxglove/ws-protocol/blob/main/docs/spec.md; playback control as in
// Foxglove's SDK.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace enfilade::server::foxglove_protocol {

inline constexpr std::string_view kSubprotocols[] = {"foxglove.sdk.v1", "foxglove.websocket.v1"};

/// The subprotocol of a Sec-WebSocket-Protocol header that the server speaks; "": none.
std::string chooseSubprotocol(std::string_view header);

// ---- from the server --------------------------------------------------------------------------

struct TimeRange {
  std::uint64_t start = 0, end = 0;  ///< nanoseconds
};

struct ServerInfo {
  std::string name, sessionId, world, scene;
  std::optional<TimeRange> playback;  ///< of a recording that the client may control
};
std::string makeServerInfo(const ServerInfo& info);

struct Channel {
  std::uint32_t id = 0;
  std::string topic, schemaName;
  std::string schema;  ///< a FileDescriptorSet, as bytes
};
std::string makeAdvertisement(std::span<const Channel> channels);
std::string makeUnadvertisement(std::span<const std::uint32_t> channels);

enum class StatusLevel : std::uint8_t { info, warning, error };
std::string makeStatus(StatusLevel level, const std::string& message);

/// Header of a message with `payload` after it.
std::vector<std::uint8_t> makeMessageHeader(std::uint32_t subscription, std::uint64_t nanoseconds);
std::vector<std::uint8_t> makeTime(std::uint64_t nanoseconds);

enum class PlaybackStatus : std::uint8_t { playing, paused, buffering, ended };
struct PlaybackState {
  PlaybackStatus status = PlaybackStatus::paused;
  std::uint64_t nanoseconds = 0;
  float speed = 1;
  std::string requestId;  ///< of the request that caused it; may be empty
};
std::vector<std::uint8_t> makePlaybackState(const PlaybackState& state);

// ---- from the client --------------------------------------------------------------------------

struct Subscribe {
  struct One {
    std::uint32_t subscription = 0, channel = 0;
  };
  std::vector<One> subscriptions;
};
struct Unsubscribe {
  std::vector<std::uint32_t> subscriptions;
};
struct PlaybackControl {
  bool play = false;
  float speed = 1;                      ///< simulated seconds per second
  std::optional<std::uint64_t> seekTo;  ///< nanoseconds
  std::string requestId;                ///< may be empty
};
/// A message that the server does not understand, or an operation that it does not offer.
struct Refused {
  std::string reason;
};
using ClientRequest = std::variant<Subscribe, Unsubscribe, PlaybackControl, Refused>;

/// Arbitrary input.
ClientRequest parseText(std::string_view text);
ClientRequest parseBinary(std::span<const std::uint8_t> bytes);

}  // namespace enfilade::server::foxglove_protocol
