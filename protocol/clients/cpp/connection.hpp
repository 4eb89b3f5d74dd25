// The client side of a non-blocking connection, shared by both clients. It handles bytes and
// messages; the clients match requests and replies.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "protocol/enfilade.pb.h"
#include "protocol/framing.hpp"

namespace enfilade::protocol {

struct Received {
  v1::ServerMessage message;
  std::vector<std::uint8_t> attachment;
};

class Connection {
 public:
  /// Starts to connect. disconnectReason() and the first message show the outcome. A host name is
  /// looked up synchronously, which may block; a numeric address never blocks.
  Connection(const std::string& host, std::uint16_t port, const FramingLimits& limits);
  ~Connection();
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  int descriptor() const { return socket_; }  ///< -1 after the connection ended
  /// POLLIN, and POLLOUT while bytes or the connection are pending.
  short pollEvents() const;
  bool connected() const { return connected_; }

  /// Queues a message and sends as many bytes as the socket accepts.
  void send(const v1::ClientMessage& message);
  std::size_t unsent() const { return out_.size() - sent_; }  ///< bytes
  /// Continues to connect, and sends as many bytes as the socket accepts.
  void advance();
  /// Sending failed. Messages that arrived before can still be read.
  bool writeFailed() const { return !writeError_.empty(); }
  /// Advances and reads. Returns the next complete message, if any.
  std::optional<Received> next();
  /// Waits until the socket is ready for the poll `events`; false after the deadline.
  bool waitFor(short events, std::chrono::steady_clock::time_point deadline);

  /// Not empty after the connection ended: the reason, with host:port and a remedy. next() still
  /// returns messages that arrived before.
  const std::string& disconnectReason() const { return disconnectReason_; }
  const std::string& peer() const { return peer_; }  ///< host:port
  void disconnect(const std::string& reason);

 private:
  void connect(const std::string& host, std::uint16_t port);
  void tryNextAddress(int problem);
  bool finishConnecting();
  void write();
  bool read();
  void handleEndOfStream();

  const std::string peer_;
  int socket_ = -1;
  std::vector<std::vector<std::uint8_t>> addresses_;  ///< sockaddr structures that were not tried
                                                      ///< yet
  bool connected_ = false;
  Decoder decoder_;
  std::vector<std::uint8_t> out_;  ///< its first `sent_` bytes are sent
  std::size_t sent_ = 0;
  std::vector<std::uint8_t> in_;
  std::size_t readCount_ = 0,
              decodedCount_ = 0;  ///< bytes received into in_, and bytes decoded from it
  std::string writeError_;        ///< reported after all earlier messages were read
  std::string disconnectReason_;
};

/// Makes the first message of a connection.
v1::ClientMessage makeHello(const std::string& clientName, const std::string& token);

/// An error as the server would send it.
v1::Error makeError(v1::ErrorCode code, const std::string& text, const std::string& field = {});

/// Validates the reply to the hello: the server's Error, or ERROR_VERSION or ERROR_BAD_MESSAGE for
/// an invalid Welcome. nullopt: valid.
std::optional<v1::Error> validateWelcome(const v1::ServerMessage& reply, const std::string& peer);

}  // namespace enfilade::protocol
