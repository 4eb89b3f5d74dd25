#include "tests/server/raw_connection.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <stdexcept>

namespace enfilade::server::testing {

RawConnection::RawConnection(std::uint16_t port) : socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (::connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    throw std::runtime_error("cannot connect to port " + std::to_string(port));
  }
}

RawConnection::~RawConnection() {
  ::close(socket_);
}

bool RawConnection::send(const std::vector<std::uint8_t>& bytes) {
  std::size_t sent = 0;
  while (sent < bytes.size()) {
    const auto count = ::send(socket_, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
    if (count <= 0) return false;
    sent += static_cast<std::size_t>(count);
  }
  return true;
}

bool RawConnection::send(const std::string& bytes) {
  return send(std::vector<std::uint8_t>(bytes.begin(), bytes.end()));
}

bool RawConnection::send(const v1::ClientMessage& message) {
  return send(protocol::encode(message));
}

void RawConnection::sendMagic() {
  send(std::string(protocol::kMagic.begin(), protocol::kMagic.end()));
}

void RawConnection::sendHello(const std::string& version) {
  sendMagic();
  v1::ClientMessage message;
  message.set_request_id(1);
  message.mutable_hello()->set_protocol_version(version);
  message.mutable_hello()->set_client_name("raw");
  send(message);
}

void RawConnection::closeSending() {
  ::shutdown(socket_, SHUT_WR);
}

std::optional<v1::ServerMessage> RawConnection::receive() {
  for (;;) {
    std::span<const std::uint8_t> bytes(unread_);
    const auto message = decoder_.next(bytes);
    unread_.assign(bytes.begin(), bytes.end());
    if (message) {
      v1::ServerMessage parsed;
      if (!protocol::parseHeader(message->header, parsed)) {
        throw std::runtime_error("the server sent what is no ServerMessage");
      }
      return parsed;
    }
    if (decoder_.error()) throw std::runtime_error(decoder_.error()->reason);
    pollfd descriptor{socket_, POLLIN, 0};
    if (::poll(&descriptor, 1, 20'000) <= 0) return std::nullopt;
    std::array<std::uint8_t, 1 << 16> buffer{};
    const auto count = ::recv(socket_, buffer.data(), buffer.size(), 0);
    if (count <= 0) return std::nullopt;
    unread_.assign(buffer.begin(), buffer.begin() + count);
  }
}

RawConnection::End RawConnection::readToEnd() {
  End end;
  while (const auto message = receive()) {
    if (message->has_error() && end.error.code() == 0) end.error = message->error();
    if (message->has_bye()) end.bye = message->bye();
  }
  end.closed = true;
  return end;
}

std::string RawConnection::readText(const std::string& end) {
  std::string text;
  pollfd descriptor{socket_, POLLIN, 0};
  while (text.find(end) == std::string::npos && ::poll(&descriptor, 1, 20'000) > 0) {
    std::array<char, 1 << 16> buffer{};
    const auto count = ::recv(socket_, buffer.data(), buffer.size(), 0);
    if (count <= 0) break;
    text.append(buffer.data(), static_cast<std::size_t>(count));
  }
  return text;
}

}  // namespace enfilade::server::testing
