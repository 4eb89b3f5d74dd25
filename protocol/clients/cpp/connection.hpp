// The client's end of a connection that never waits: what both clients are made of. Knows bytes and
// messages; requests and replies are theirs.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
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
  /// Begins to connect; whether that worked is told by broken(), and by the first message. A name
  /// is looked up at once, which may wait for the system's resolver: an address in numbers never
  /// waits.
  Connection(const std::string& host, std::uint16_t port, const FramingLimits& limits);
  ~Connection();
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  int descriptor() const { return socket_; }  ///< -1 once it is broken
  /// POLLIN, and POLLOUT where something waits to be sent or for the connection.
  short wanted() const;
  bool connected() const { return connected_; }

  /// Queues a message, and sends what the socket takes of the queue.
  void send(const v1::ClientMessage& message);
  std::size_t unsent() const { return out_.size() - sent_; }  ///< bytes
  /// Goes on connecting, and sends what the socket takes now.
  void advance();
  /// Nothing more can be sent; what the server said before may still be read.
  bool writeFailed() const { return !writeProblem_.empty(); }
  /// Advances, and reads what is there. The next message, when one is whole.
  std::optional<Received> next();
  /// Waits until the socket is ready for `what`; false when the deadline came first.
  bool await(short what, std::chrono::steady_clock::time_point deadline);

  /// Not empty: the connection is over, why, and what to try. Names host:port. Messages that came
  /// before are still given by next().
  const std::string& broken() const { return broken_; }
  const std::string& peer() const { return peer_; }  ///< host:port
  void breakOff(const std::string& reason);

 private:
  void connect(const std::string& host, std::uint16_t port);
  void tryNext(int problem);
  bool finishConnecting();
  void write();
  bool read();
  void endOfStream();

  const std::string peer_;
  int socket_ = -1;
  std::vector<std::vector<std::uint8_t>> addresses_;  ///< sockaddr: those that were not tried yet
  bool connected_ = false;
  Decoder decoder_;
  std::vector<std::uint8_t> out_;  ///< its first `sent_` bytes are sent
  std::size_t sent_ = 0;
  std::vector<std::uint8_t> in_;
  std::size_t count_ = 0, taken_ = 0;  ///< of in_: bytes that came, and that the decoder has
  std::string writeProblem_;           ///< told when what came before it is read
  std::string broken_;
};

/// The first message on a connection.
v1::ClientMessage helloOf(const std::string& clientName, const std::string& token);

/// Why the answer to the hello makes no connection: an Error of the server, or ERROR_VERSION,
/// ERROR_BAD_MESSAGE of what is wrong with its Welcome. nullopt: be welcome.
std::optional<v1::Error> welcomeProblem(const v1::ServerMessage& answer, const std::string& peer);

}  // namespace enfilade::protocol
