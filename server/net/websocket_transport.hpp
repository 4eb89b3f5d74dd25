// The protocol's bytes as the binary messages of a WebSocket (RFC 6455).
//
// This header uses Asio and Beast; only http_session.cpp includes it.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/http/string_body.hpp>
#include <boost/beast/websocket/stream.hpp>

#include "server/net/transport.hpp"

namespace enfilade::server {

class WebSocketTransport : public Transport {
 public:
  using Request = boost::beast::http::request<boost::beast::http::string_body>;

  WebSocketTransport(boost::asio::ip::tcp::socket socket, Request request);
  void read(ReadHandler done) override;
  void write(EncodedMessage message, WriteHandler done) override;
  void shutdownSend(std::function<void()> done) override;
  void close() override;
  bool peerClosed() override;
  const std::string& peer() const override { return peer_; }
  bool usesMagic() const override { return false; }

 private:
  void readMessage(ReadHandler done);
  void refuseText(ReadHandler done);

  const std::string peer_;
  boost::beast::websocket::stream<boost::asio::ip::tcp::socket> stream_;
  Request request_;
  boost::beast::flat_buffer in_;
  bool accepted_ = false;
};

}  // namespace enfilade::server
