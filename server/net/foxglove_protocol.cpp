#include "server/net/foxglove_protocol.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>

#include "protocol/json_depth.hpp"
#include "scene/model/trim.hpp"
#include "server/export/base64.hpp"
#include "server/log/sanitize_for_log.hpp"

namespace enfilade::server::foxglove_protocol {
namespace {

static_assert(std::endian::native == std::endian::little, "the protocol is little-endian");

using Json = nlohmann::json;

// Operations of binary messages.
constexpr std::uint8_t kMessageData = 1, kTime = 2, kPlaybackState = 5;  // from the server
constexpr std::uint8_t kPlaybackControl = 3;                             // from the client

constexpr std::size_t kMaxEchoedBytes = 64;  // of a client's text in an answer

std::string dump(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

template <class Number>
void append(std::vector<std::uint8_t>& bytes, Number number) {
  const std::size_t end = bytes.size();
  bytes.resize(end + sizeof number);
  std::memcpy(bytes.data() + end, &number, sizeof number);
}

/// Removes a number from the front; the caller has checked the size.
template <class Number>
Number take(std::span<const std::uint8_t>& bytes) {
  Number number{};
  std::memcpy(&number, bytes.data(), sizeof number);
  bytes = bytes.subspan(sizeof number);
  return number;
}

std::optional<std::uint32_t> toId(const Json& value) {
  if (!value.is_number_unsigned() || value.get<std::uint64_t>() > UINT32_MAX) return std::nullopt;
  return value.get<std::uint32_t>();
}

std::optional<std::uint32_t> findId(const Json& object, const char* key) {
  const auto found = object.find(key);
  return found == object.end() ? std::nullopt : toId(*found);
}

ClientRequest parseSubscribe(const Json& message) {
  Subscribe request;
  const auto list = message.find("subscriptions");
  if (list == message.end() || !list->is_array())
    return Refused{"subscribe: 'subscriptions' must be a list"};
  for (const Json& one : *list) {
    const auto subscription = one.is_object() ? findId(one, "id") : std::nullopt;
    const auto channel = one.is_object() ? findId(one, "channelId") : std::nullopt;
    if (!subscription || !channel)
      return Refused{"subscribe: each subscription needs the numbers 'id' and 'channelId'"};
    request.subscriptions.push_back({*subscription, *channel});
  }
  return request;
}

ClientRequest parseUnsubscribe(const Json& message) {
  Unsubscribe request;
  const auto list = message.find("subscriptionIds");
  if (list == message.end() || !list->is_array())
    return Refused{"unsubscribe: 'subscriptionIds' must be a list"};
  for (const Json& one : *list) {
    const auto subscription = toId(one);
    if (!subscription) return Refused{"unsubscribe: each of 'subscriptionIds' must be a number"};
    request.subscriptions.push_back(*subscription);
  }
  return request;
}

}  // namespace

std::string chooseSubprotocol(std::string_view header) {
  while (!header.empty()) {
    const std::size_t comma = header.find(',');
    const std::string_view word = scene::trim(header.substr(0, comma));
    if (std::find(std::begin(kSubprotocols), std::end(kSubprotocols), word) !=
        std::end(kSubprotocols))
      return std::string(word);
    header = comma == std::string_view::npos ? std::string_view{} : header.substr(comma + 1);
  }
  return {};
}

std::string makeServerInfo(const ServerInfo& info) {
  Json message{{"op", "serverInfo"},
               {"name", info.name},
               {"capabilities", {"time"}},
               {"metadata", {{"world", info.world}, {"scene", info.scene}}},
               {"sessionId", info.sessionId}};
  if (info.playback) {
    message["capabilities"].push_back("playbackControl");
    message["dataStartTime"] = info.playback->start;
    message["dataEndTime"] = info.playback->end;
  }
  return dump(message);
}

std::string makeAdvertisement(std::span<const Channel> channels) {
  Json list = Json::array();
  for (const Channel& channel : channels) {
    const auto* schema = reinterpret_cast<const std::uint8_t*>(channel.schema.data());
    list.push_back({{"id", channel.id},
                    {"topic", channel.topic},
                    {"encoding", "protobuf"},
                    {"schemaName", channel.schemaName},
                    {"schemaEncoding", "protobuf"},
                    {"schema", encodeBase64({schema, channel.schema.size()})}});
  }
  return dump({{"op", "advertise"}, {"channels", std::move(list)}});
}

std::string makeUnadvertisement(std::span<const std::uint32_t> channels) {
  return dump({{"op", "unadvertise"},
               {"channelIds", std::vector<std::uint32_t>(channels.begin(), channels.end())}});
}

std::string makeStatus(StatusLevel level, const std::string& message) {
  return dump({{"op", "status"}, {"level", static_cast<int>(level)}, {"message", message}});
}

std::vector<std::uint8_t> makeMessageHeader(std::uint32_t subscription, std::uint64_t nanoseconds) {
  std::vector<std::uint8_t> bytes{kMessageData};
  append(bytes, subscription);
  append(bytes, nanoseconds);
  return bytes;
}

std::vector<std::uint8_t> makeTime(std::uint64_t nanoseconds) {
  std::vector<std::uint8_t> bytes{kTime};
  append(bytes, nanoseconds);
  return bytes;
}

std::vector<std::uint8_t> makePlaybackState(const PlaybackState& state) {
  std::vector<std::uint8_t> bytes{kPlaybackState, static_cast<std::uint8_t>(state.status)};
  append(bytes, state.nanoseconds);
  append(bytes, state.speed);
  append(bytes, static_cast<std::uint32_t>(state.requestId.size()));
  bytes.insert(bytes.end(), state.requestId.begin(), state.requestId.end());
  return bytes;
}

ClientRequest parseText(std::string_view text) {
  // A parser callback bounds the depth: values are destroyed by recursion.
  const auto shallow = [](int depth, Json::parse_event_t, Json&) {
    if (depth > protocol::kMaxJsonDepth) throw std::runtime_error("too deep");
    return true;
  };
  Json message;
  try {
    message = Json::parse(text, shallow);
  } catch (const std::exception&) {
    return Refused{"a text message must be one JSON object"};
  }
  const std::string op = message.is_object() ? message.value("op", Json()).dump() : "null";
  if (op == "\"subscribe\"") return parseSubscribe(message);
  if (op == "\"unsubscribe\"") return parseUnsubscribe(message);
  return Refused{"this server does not offer the operation " + sanitizeForLog(op, kMaxEchoedBytes)};
}

ClientRequest parseBinary(std::span<const std::uint8_t> bytes) {
  if (bytes.empty() || bytes[0] != kPlaybackControl)
    return Refused{"this server does not offer this binary operation"};
  bytes = bytes.subspan(1);
  // Command, speed, whether the time is a seek, time. Then the id; older clients have none.
  constexpr std::size_t kFixedBytes = 1 + 4 + 1 + 8;
  if (bytes.size() < kFixedBytes) return Refused{"playback control: the message is too short"};
  PlaybackControl request;
  const auto command = take<std::uint8_t>(bytes);
  request.speed = take<float>(bytes);
  const bool seeks = take<std::uint8_t>(bytes) != 0;
  const auto time = take<std::uint64_t>(bytes);
  if (command > 1) return Refused{"playback control: the command must be 0 (play) or 1 (pause)"};
  if (!std::isfinite(request.speed) || request.speed <= 0)
    return Refused{"playback control: the speed must be above 0"};
  request.play = command == 0;
  if (seeks) request.seekTo = time;
  if (bytes.size() >= sizeof(std::uint32_t)) {
    const auto length = take<std::uint32_t>(bytes);
    if (length > bytes.size()) return Refused{"playback control: the request id is cut off"};
    request.requestId.assign(bytes.begin(), bytes.begin() + length);
  }
  return request;
}

}  // namespace enfilade::server::foxglove_protocol
