// The protocol's bytes as the binary messages of a WebSocket (RFC 6455).
//
// Asio and Beast appear in this header, which only http_visit.cpp includes.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/http/string_body.hpp>
#include <boost/beast/websocket/stream.hpp>

#include "server/net/transport.hpp"

namespace enfilade::server {

class WebSocketWire : public Wire {
 public:
  using Request = boost::beast::http::request<boost::beast::http::string_body>;

  WebSocketWire(boost::asio::ip::tcp::socket socket, Request request);
  void read(Heard done) override;
  void write(Encoded message, Written done) override;
  void endSending(std::function<void()> done) override;
  void close() override;
  bool peerEnded() override;
  const std::string& peer() const override { return peer_; }
  bool beginsWithMagic() const override { return false; }

 private:
  void readMessage(Heard done);

  const std::string peer_;
  boost::beast::websocket::stream<boost::asio::ip::tcp::socket> stream_;
  Request request_;
  boost::beast::flat_buffer in_;
  bool accepted_ = false;
};

}  // namespace enfilade::server
