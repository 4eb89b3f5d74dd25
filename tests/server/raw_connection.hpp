// A socket that sends arbitrary bytes and reads the server's answers.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "protocol/enfilade.pb.h"
#include "protocol/framing.hpp"

namespace enfilade::server::testing {

class RawConnection {
 public:
  explicit RawConnection(std::uint16_t port);
  ~RawConnection();
  RawConnection(const RawConnection&) = delete;
  RawConnection& operator=(const RawConnection&) = delete;

  /// Sends all bytes; false if the server has closed.
  bool send(const std::vector<std::uint8_t>& bytes);
  bool send(const std::string& bytes);
  bool send(const v1::ClientMessage& message);
  void sendMagic();
  void sendHello(const std::string& version = "1.0.0");
  void closeSending();
  /// The next message; nullopt if the server closed, or was silent for 20 s.
  std::optional<v1::ServerMessage> receive();
  /// Result of reading to the end of the stream: the last Bye, and the first Error before it.
  struct End {
    v1::Bye bye;
    v1::Error error;
    bool closed = false;
  };
  End readToEnd();
  /// Received text until it contains `end`, the server closes, or 20 s pass.
  std::string readText(const std::string& end = "\x01 never");

 private:
  int socket_ = -1;
  protocol::Decoder decoder_{protocol::kClientLimits};
  std::vector<std::uint8_t> unread_;
};

}  // namespace enfilade::server::testing
