#include "tests/protocol/test_server.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <stdexcept>

namespace enfilade::protocol {

std::optional<v1::ClientMessage> TestConnection::receive() {
  for (;;) {
    if (const auto message = decoder_.next(unread_)) {
      v1::ClientMessage parsed;
      if (!parseHeader(message->header, parsed)) {
        throw std::runtime_error("the client sent what is no ClientMessage");
      }
      return parsed;
    }
    if (decoder_.error()) throw std::runtime_error(decoder_.error()->reason);
    buffer_.resize(4096);
    const auto count = ::recv(descriptor_, buffer_.data(), buffer_.size(), 0);
    if (count <= 0) return std::nullopt;
    unread_ = std::span<const std::uint8_t>(buffer_).first(static_cast<std::size_t>(count));
  }
}

void TestConnection::sendRaw(std::span<const std::uint8_t> bytes) {
  while (!bytes.empty()) {
    const auto count = ::send(descriptor_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (count <= 0) return;  // the client is gone
    bytes = bytes.subspan(static_cast<std::size_t>(count));
  }
}

void TestConnection::sendRaw(const std::string& text) {
  const std::vector<std::uint8_t> bytes(text.begin(), text.end());
  sendRaw(std::span<const std::uint8_t>(bytes));
}

void TestConnection::send(const v1::ServerMessage& message,
                          std::span<const std::uint8_t> attachment) {
  const std::vector<std::uint8_t> bytes = encode(message, attachment);
  sendRaw(std::span<const std::uint8_t>(bytes));
}

v1::ClientMessage TestConnection::greet() {
  const auto hello = receive();
  if (!hello) throw std::runtime_error("the client closed before its hello");
  sendRaw(std::span<const std::uint8_t>(kMagic));
  send(makeWelcomeTo(*hello));
  return *hello;
}

void TestConnection::waitUntilClosed() {
  while (receive()) {
  }
}

v1::ServerMessage makeEvents(std::uint64_t sequence) {
  v1::ServerMessage message;
  message.mutable_events()->set_sequence(sequence);
  return message;
}

v1::ServerMessage makeWelcomeTo(const v1::ClientMessage& hello) {
  v1::ServerMessage reply;
  reply.set_reply_to(hello.request_id());
  v1::Welcome& welcome = *reply.mutable_welcome();
  welcome.set_protocol_version(kVersion);
  welcome.mutable_policies()->set_tick(1.0 / 60.0);
  welcome.mutable_scene()->set_objects(10);
  return reply;
}

TestServer::TestServer(std::function<void(TestConnection&)> behave)
    : listener_(::socket(AF_INET, SOCK_STREAM, 0)) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t length = sizeof(address);
  auto* const any = reinterpret_cast<sockaddr*>(&address);
  if (::bind(listener_, any, length) != 0 || ::listen(listener_, 1) != 0 ||
      ::getsockname(listener_, any, &length) != 0) {
    throw std::runtime_error("cannot listen on loopback");
  }
  port_ = ntohs(address.sin_port);
  thread_ = std::jthread([listener = listener_, behave = std::move(behave)] {
    const int descriptor = ::accept(listener, nullptr, nullptr);
    if (descriptor < 0) return;
    TestConnection connection(descriptor);
    behave(connection);
    ::close(descriptor);
  });
}

TestServer::~TestServer() {
  ::shutdown(listener_, SHUT_RDWR);  // ends an accept() without a client
  thread_.join();
  ::close(listener_);
}

}  // namespace enfilade::protocol
