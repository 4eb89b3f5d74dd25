// A viewer (Foxglove, Lichtblick) that watches a world live over the Foxglove WebSocket protocol.
// It joins its world as a client, for pictures and the control of a replay, and has a ViewerFeed
// for the other channels. Network thread only.
//
// This header uses Asio and Beast; only http_session.cpp includes it.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/http/string_body.hpp>
#include <boost/beast/websocket/stream.hpp>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "server/hosting/viewer_feed.hpp"
#include "server/net/foxglove_protocol.hpp"
#include "server/net/server_context.hpp"

namespace enfilade::server {

class FoxgloveSession : public ClientConnection,
                        public std::enable_shared_from_this<FoxgloveSession> {
 public:
  using Request = boost::beast::http::request<boost::beast::http::string_body>;

  /// `request` is an upgrade that offers `subprotocol`.
  FoxgloveSession(boost::asio::ip::tcp::socket socket, Request request, std::string subprotocol,
                  ServerContext& context, std::shared_ptr<TickLoop> world, Role role);
  void start();
  void end(v1::ErrorCode code, const std::string& reason) override;
  bool evictIfAnonymous() override { return false; }  // it was authenticated by the upgrade

 private:
  /// A WebSocket message.
  struct Outgoing {
    bool isText = false;
    EncodedMessage bytes;
  };
  /// The channels of an avatar's view: image, and calibration with the next id.
  struct ViewChannels {
    std::uint32_t imageChannel = 0;
    std::uint32_t watch = 0;  ///< of the world's client; 0: not subscribed
  };

  void join();
  void read();
  void handle(foxglove_protocol::ClientRequest request);
  void subscribe(const foxglove_protocol::Subscribe& request);
  void unsubscribe(const foxglove_protocol::Unsubscribe& request);
  void applySubscriptions(bool sceneIsNew);
  void applyViewSubscription(const std::string& avatar, ViewChannels& view);
  void requestSceneModel();
  void controlPlayback(const foxglove_protocol::PlaybackControl& request);

  void greet(const v1::Welcome& welcome);
  void advertise(const std::vector<foxglove_protocol::Channel>& channels);
  void updateAvatars(const std::string& names);
  void handleReply(const v1::ServerMessage& message, std::span<const std::uint8_t> attachment);
  void sendImages(const v1::Frame& frame, std::span<const std::uint8_t> attachment);
  void forward(const ViewerMessage& message);
  void sendPlaybackState(const std::string& requestId);
  void sendStatus(foxglove_protocol::StatusLevel level, const std::string& message);
  void sendText(const std::string& text);
  void sendBytes(std::vector<std::uint8_t> head, Buffer payload = nullptr);
  void sendOnChannel(std::uint32_t channel, std::uint64_t nanoseconds, Buffer payload);
  std::uint64_t request(v1::ClientMessage message);
  bool isSubscribed(std::uint32_t channel) const { return subscriptions_.contains(channel); }

  void sendNext();
  bool takeReplies();
  void write(Outgoing message);
  void close(const std::string& reason);

  boost::beast::websocket::stream<boost::asio::ip::tcp::socket> stream_;
  Request request_;
  const std::string subprotocol_;
  ServerContext& context_;
  const std::string peer_;
  const std::shared_ptr<TickLoop> world_;
  const Role role_;
  boost::beast::flat_buffer in_;
  std::shared_ptr<OutgoingQueue> replies_;  ///< of the world's client
  std::shared_ptr<OutgoingQueue> feed_;     ///< of the ViewerFeed
  ClientId client_ = 0;
  std::uint64_t lastRequest_ = 0;
  std::map<std::uint32_t, std::uint32_t> subscriptions_;  ///< subscription, by channel
  std::map<std::string, ViewChannels> views_;             ///< by avatar
  std::uint32_t nextViewChannel_;
  std::uint64_t now_ = 0;  ///< nanoseconds of simulated time
  double tickSeconds_ = 0;
  std::optional<v1::Replay> replay_;
  std::uint64_t awaitedRequest_ = 0;  ///< the last request of a playback control
  std::string awaitedPlaybackId_;
  std::deque<Outgoing> outgoing_;
  bool accepted_ = false, writing_ = false, ending_ = false, closed_ = false;
};

}  // namespace enfilade::server
