// A server for one connection with a given behaviour, for testing clients.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "protocol/enfilade.pb.h"
#include "protocol/framing.hpp"

namespace enfilade::protocol {

/// The server's end of a connection, blocking.
class TestConnection {
 public:
  explicit TestConnection(int descriptor) : descriptor_(descriptor) {}

  /// The client's next message; nullopt if it closed.
  std::optional<v1::ClientMessage> receive();
  void sendRaw(std::span<const std::uint8_t> bytes);
  void sendRaw(const std::string& text);
  void send(const v1::ServerMessage& message, std::span<const std::uint8_t> attachment = {});
  /// Receives Hello, then sends the magic and a Welcome. Returns the Hello.
  v1::ClientMessage greet();
  void waitUntilClosed();  ///< discards input until the client closes

 private:
  int descriptor_;
  Decoder decoder_{kServerLimits};
  std::vector<std::uint8_t> buffer_;
  std::span<const std::uint8_t> unread_;
};

v1::ServerMessage makeWelcomeTo(const v1::ClientMessage& hello);
v1::ServerMessage makeEvents(std::uint64_t sequence);

class TestServer {
 public:
  /// Serves the first connection with `behave` on its own thread, then closes it.
  explicit TestServer(std::function<void(TestConnection&)> behave);
  ~TestServer();  ///< waits for `behave`
  TestServer(const TestServer&) = delete;
  TestServer& operator=(const TestServer&) = delete;

  std::uint16_t getPort() const { return port_; }

 private:
  int listener_;
  std::uint16_t port_ = 0;
  std::jthread thread_;
};

}  // namespace enfilade::protocol
