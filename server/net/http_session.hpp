// One request over HTTP/1.1: becomes a WebSocket, or is answered: /healthz, /metrics, /mjpeg/... It
// asks the worlds as any client does, through their tick loops.
//
// Asio and Beast appear in this header, which only files of connections include.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/string_body.hpp>

#include "server/net/http_pages.hpp"
#include "server/net/server_context.hpp"

namespace enfilade::server {

class HttpVisit : public Connection, public std::enable_shared_from_this<HttpVisit> {
 public:
  using Clock = std::chrono::steady_clock;

  /// `first` was read already.
  HttpVisit(boost::asio::ip::tcp::socket socket, const std::vector<std::uint8_t>& first,
            Reception& reception);
  ~HttpVisit() override;
  /// The whole request has to be here by `deadline`.
  void start(Clock::time_point deadline);
  void end(v1::ErrorCode code, const std::string& reason) override;
  bool giveWay() override;

 private:
  using Request = boost::beast::http::request<boost::beast::http::string_body>;

  void route(Request request);
  void upgrade(Request request);
  void answer(unsigned status, const std::string& type, std::string body);
  void refuse(unsigned status, const std::string& why);
  void write(Buffer bytes, bool last);
  /// What one world says to us.
  struct Ear {
    std::shared_ptr<TickLoop> world;
    std::shared_ptr<OutgoingQueue> heard;
    ClientId client = 0;
    std::optional<v1::Metrics> metrics;
    bool ended = false;  ///< it says nothing more
  };

  bool findWorlds(const Target& target);
  void ask(v1::ClientMessage request, Role role);
  void join(Ear& ear, Role role);
  void hear();
  void hear(Ear& ear);
  void take(Ear& ear, v1::ServerMessage message, std::vector<std::uint8_t> attachment);
  void answerMetrics();
  void armTimer(Clock::time_point deadline, unsigned status, std::string why);
  void noticeLeaving();
  void close();

  boost::asio::ip::tcp::socket socket_;
  boost::asio::steady_timer timer_;
  Reception& reception_;
  const std::string peer_;
  Clock::time_point deadline_;
  boost::beast::flat_buffer in_;
  boost::beast::http::request_parser<boost::beast::http::string_body> parser_;
  std::array<char, 256> thrownAway_{};
  std::string path_;
  std::vector<Ear> ears_;      ///< one, or for metrics as many as there are worlds
  bool mayHearNames_ = false;  ///< of worlds
  bool writing_ = false, answered_ = false, noticing_ = false, closed_ = false;
};

}  // namespace enfilade::server
