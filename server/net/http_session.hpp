// One HTTP/1.1 request: a file of the page, /scene.glb, /healthz, /metrics, /mjpeg/..., or an
// upgrade to WebSocket. It queries the worlds like any client, through their tick loops.
//
// This header uses Asio and Beast; only connection files include it.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/string_body.hpp>

#include "server/net/http_pages.hpp"
#include "server/net/server_context.hpp"

namespace enfilade::server {

class HttpSession : public ClientConnection, public std::enable_shared_from_this<HttpSession> {
 public:
  using Clock = std::chrono::steady_clock;

  /// `first`: bytes already read from the socket.
  HttpSession(boost::asio::ip::tcp::socket socket, const std::vector<std::uint8_t>& first,
              ServerContext& context);
  ~HttpSession() override;
  /// The complete request must arrive before `deadline`.
  void start(Clock::time_point deadline);
  /// The server is full: all but /healthz and /metrics get 503.
  void admitOnlyHealthChecks() { isFull_ = true; }
  void end(v1::ErrorCode code, const std::string& reason) override;
  bool evictIfAnonymous() override;

 private:
  using Request = boost::beast::http::request<boost::beast::http::string_body>;

  void route(Request request);
  void upgrade(Request request);
  void upgradeToViewer(Request request, const std::string& subprotocol, const Target& target,
                       const std::string& token);
  void sendResponse(unsigned status, const std::string& type, std::string body);
  void refuse(unsigned status, const std::string& reason);
  void write(Buffer bytes, bool last, std::size_t offset = 0);
  bool servePage();
  void requestSceneFile(const Target& target);
  void sendSceneFile(const SceneFile& file, bool compressed);
  void sendFile(const HttpFile& file);
  /// The query to one world, and its reply.
  struct WorldReply {
    std::shared_ptr<TickLoop> world;
    std::shared_ptr<OutgoingQueue> queue;
    ClientId client = 0;
    std::optional<v1::Metrics> metrics;
    bool ended = false;  ///< no more messages follow
  };

  bool findWorlds(const Target& target);
  void queryWorlds(v1::ClientMessage request, Role role);
  void joinWorld(WorldReply& reply, Role role);
  void pollReplies();
  void pollWorld(WorldReply& reply);
  void handleReply(WorldReply& reply, v1::ServerMessage message,
                   std::vector<std::uint8_t> attachment);
  void sendMetrics();
  void startStream(const v1::Frame& frame, std::span<const std::uint8_t> attachment);
  void waitForNextPart();
  void armTimer(Clock::time_point deadline, unsigned status, std::string reason);
  void watchDisconnect();
  void close();

  boost::asio::ip::tcp::socket socket_;
  boost::asio::steady_timer timer_;
  ServerContext& context_;
  const std::string peer_;
  Clock::time_point deadline_;
  boost::beast::flat_buffer in_;
  boost::beast::http::request_parser<boost::beast::http::string_body> parser_;
  std::array<char, 256> discarded_{};
  std::string path_;
  std::string ifNoneMatch_, acceptEncoding_;  ///< headers of the request
  Buffer body_;                               ///< sent after the header
  std::vector<WorldReply> replies_;           ///< one; for metrics, one per world
  bool isFull_ = false;                       ///< see admitOnlyHealthChecks()
  bool headOnly_ = false;                     ///< HEAD: the response has no body
  bool streams_ = false;                      ///< counted in ServerContext::streams
  Buffer lastPart_;                           ///< of a stream, until it was sent again
  bool mayShowNames_ = false;                 ///< the response may name worlds
  bool awaitsFile_ = false;                   ///< of the scene, which is being made
  bool writing_ = false, answered_ = false, watching_ = false, closed_ = false;
};

}  // namespace enfilade::server
