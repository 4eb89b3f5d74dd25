// Tests of the messages of the Foxglove WebSocket protocol, with arbitrary input.
#include "server/net/foxglove_protocol.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <random>

namespace enfilade::server::testing {
namespace {

namespace wire = foxglove_protocol;

std::string getReason(const wire::ClientRequest& request) {
  const auto* refused = std::get_if<wire::Refused>(&request);
  return refused ? refused->reason : "";
}

std::vector<std::uint8_t> makePlaybackControl(std::uint8_t command, float speed, bool seeks,
                                              std::uint64_t time, const std::string& id) {
  std::vector<std::uint8_t> bytes{3, command};
  const auto append = [&](const void* data, std::size_t count) {
    const auto* first = static_cast<const std::uint8_t*>(data);
    bytes.insert(bytes.end(), first, first + count);
  };
  append(&speed, sizeof speed);
  bytes.push_back(seeks ? 1 : 0);
  append(&time, sizeof time);
  const auto length = static_cast<std::uint32_t>(id.size());
  append(&length, sizeof length);
  append(id.data(), id.size());
  return bytes;
}

TEST(FoxgloveProtocol, ChoosesTheFirstSubprotocolThatItSpeaks) {
  EXPECT_EQ(wire::chooseSubprotocol("foxglove.websocket.v1"), "foxglove.websocket.v1");
  EXPECT_EQ(wire::chooseSubprotocol("soap, foxglove.sdk.v1 ,foxglove.websocket.v1"),
            "foxglove.sdk.v1");
  EXPECT_EQ(wire::chooseSubprotocol("foxglove.websocket.v2, ,"), "");
  EXPECT_EQ(wire::chooseSubprotocol(""), "");
}

TEST(FoxgloveProtocol, ReadsSubscriptions) {
  const auto request = wire::parseText(
      R"({"op":"subscribe","subscriptions":[{"id":7,"channelId":2},{"id":8,"channelId":3}]})");
  const auto& subscribe = std::get<wire::Subscribe>(request);
  ASSERT_EQ(subscribe.subscriptions.size(), 2u);
  EXPECT_EQ(subscribe.subscriptions[1].subscription, 8u);
  EXPECT_EQ(subscribe.subscriptions[1].channel, 3u);
  const auto ended = wire::parseText(R"({"op":"unsubscribe","subscriptionIds":[7]})");
  EXPECT_EQ(std::get<wire::Unsubscribe>(ended).subscriptions, std::vector<std::uint32_t>{7});
}

TEST(FoxgloveProtocol, RefusesTextInWords) {
  for (const std::string text :
       {"", "{", "7", "[]", "{}", R"({"op":7})", R"({"op":"fetchAsset"})", R"({"op":"subscribe"})",
        R"({"op":"subscribe","subscriptions":[7]})",
        R"({"op":"subscribe","subscriptions":[{"id":-1,"channelId":1}]})",
        R"({"op":"subscribe","subscriptions":[{"id":4294967296,"channelId":1}]})",
        R"({"op":"unsubscribe","subscriptionIds":["a"]})"})
    EXPECT_NE(getReason(wire::parseText(text)), "") << text;
  EXPECT_NE(getReason(wire::parseText(std::string(100'000, '['))), "");
}

TEST(FoxgloveProtocol, ReadsPlaybackControlWithAndWithoutAnId) {
  auto bytes = makePlaybackControl(0, 2.5f, true, 5'000'000'000, "abc");
  auto control = std::get<wire::PlaybackControl>(wire::parseBinary(bytes));
  EXPECT_TRUE(control.play);
  EXPECT_EQ(control.speed, 2.5f);
  EXPECT_EQ(control.seekTo, 5'000'000'000u);
  EXPECT_EQ(control.requestId, "abc");
  bytes = makePlaybackControl(1, 1, false, 9, "");
  bytes.resize(15);  // as older clients send it
  control = std::get<wire::PlaybackControl>(wire::parseBinary(bytes));
  EXPECT_FALSE(control.play);
  EXPECT_FALSE(control.seekTo);
}

TEST(FoxgloveProtocol, RefusesBinaryMessagesInWords) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  EXPECT_NE(getReason(wire::parseBinary({})), "");
  EXPECT_NE(getReason(wire::parseBinary(makePlaybackControl(2, 1, false, 0, ""))), "");
  EXPECT_NE(getReason(wire::parseBinary(makePlaybackControl(0, 0, false, 0, ""))), "");
  EXPECT_NE(getReason(wire::parseBinary(makePlaybackControl(0, kInfinity, false, 0, ""))), "");
  auto cut = makePlaybackControl(0, 1, false, 0, "abc");
  cut.pop_back();
  EXPECT_NE(getReason(wire::parseBinary(cut)), "");
}

TEST(FoxgloveProtocol, SurvivesMutatedMessages) {
  std::mt19937 random(11);
  const std::string text =
      R"({"op":"subscribe","subscriptions":[{"id":7,"channelId":2},{"id":8,"channelId":3}]})";
  const auto binary = makePlaybackControl(0, 2, true, 77, "identity");
  for (int round = 0; round < 2000; ++round) {
    std::string mutatedText = text;
    auto mutatedBinary = binary;
    for (int edit = 0; edit < 4; ++edit) {
      mutatedText[random() % mutatedText.size()] = static_cast<char>(random());
      mutatedBinary[random() % mutatedBinary.size()] = static_cast<std::uint8_t>(random());
    }
    mutatedBinary.resize(random() % (mutatedBinary.size() + 1));
    const auto fromText = wire::parseText(mutatedText);
    if (const auto* subscribe = std::get_if<wire::Subscribe>(&fromText)) {
      EXPECT_EQ(subscribe->subscriptions.size(), 2u);
    }
    const auto fromBinary = wire::parseBinary(mutatedBinary);
    if (const auto* control = std::get_if<wire::PlaybackControl>(&fromBinary)) {
      EXPECT_GT(control->speed, 0);
    }
  }
}

TEST(FoxgloveProtocol, EncodesMessagesLittleEndian) {
  EXPECT_EQ(wire::makeMessageHeader(0x01020304, 5),
            (std::vector<std::uint8_t>{1, 4, 3, 2, 1, 5, 0, 0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(wire::makeTime(256), (std::vector<std::uint8_t>{2, 0, 1, 0, 0, 0, 0, 0, 0}));
  const auto state = wire::makePlaybackState({wire::PlaybackStatus::ended, 1, 1, "ab"});
  EXPECT_EQ(state, (std::vector<std::uint8_t>{5, 3, 1,    0,    0, 0, 0, 0, 0,   0,
                                              0, 0, 0x80, 0x3f, 2, 0, 0, 0, 'a', 'b'}));
}

}  // namespace
}  // namespace enfilade::server::testing
