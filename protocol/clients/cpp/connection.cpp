#include "protocol/clients/cpp/connection.hpp"

#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <memory>
#include <system_error>

namespace enfilade::protocol {
namespace {

constexpr std::size_t kReadBytes = 1 << 16;         // bytes
constexpr std::size_t kCompactThreshold = 1 << 16;  // sent bytes before the buffer is compacted

constexpr const char* kRemedy =
    "; is `enfilade serve` running there, and does the port match its ready line?";

std::string getErrorText(int error) {
  return std::generic_category().message(error);
}

bool wouldBlock(int error) {
  return error == EAGAIN || error == EWOULDBLOCK;
}

}  // namespace

Connection::Connection(const std::string& host, std::uint16_t port, const FramingLimits& limits)
    : peer_(host + ":" + std::to_string(port)),
      decoder_(limits),
      out_(kMagic.begin(), kMagic.end()) {
  connect(host, port);
}

Connection::~Connection() {
  if (socket_ >= 0) ::close(socket_);
}

void Connection::disconnect(const std::string& reason) {
  if (!disconnectReason_.empty()) return;
  disconnectReason_ = reason;
  if (socket_ >= 0) ::close(socket_);
  socket_ = -1;
}

void Connection::connect(const std::string& host, std::uint16_t port) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* list = nullptr;
  const int unknown = ::getaddrinfo(host.c_str(), std::to_string(port).c_str(), &hints, &list);
  if (unknown != 0) {
    return disconnect("cannot connect to " + peer_ + ": " + ::gai_strerror(unknown) +
                      "; give a host name that this machine can resolve, or a numeric address");
  }
  const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> addresses(list, &::freeaddrinfo);
  for (const addrinfo* one = list; one; one = one->ai_next) {
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(one->ai_addr);
    addresses_.emplace_back(bytes, bytes + one->ai_addrlen);
  }
  tryNextAddress(0);
}

/// Tries the remaining addresses until one connects or is pending. `problem`: errno of the
/// previous.
void Connection::tryNextAddress(int problem) {
  if (socket_ >= 0) ::close(socket_);
  socket_ = -1;
  while (!addresses_.empty()) {
    const std::vector<std::uint8_t> address = std::move(addresses_.front());
    addresses_.erase(addresses_.begin());
    const auto* one = reinterpret_cast<const sockaddr*>(address.data());
    socket_ = ::socket(one->sa_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    if (socket_ < 0) {
      problem = errno;
      continue;
    }
    const int yes = 1;
    ::setsockopt(socket_, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
    connected_ = ::connect(socket_, one, static_cast<socklen_t>(address.size())) == 0;
    if (connected_ || errno == EINPROGRESS) return;
    problem = errno;
    ::close(socket_);
    socket_ = -1;
  }
  disconnect("cannot connect to " + peer_ + ": " + getErrorText(problem) + kRemedy);
}

/// Returns false while the connection is pending.
bool Connection::finishConnecting() {
  if (connected_) return true;
  pollfd descriptor{socket_, POLLOUT, 0};
  if (::poll(&descriptor, 1, 0) <= 0) return false;
  int problem = 0;
  socklen_t length = sizeof problem;
  ::getsockopt(socket_, SOL_SOCKET, SO_ERROR, &problem, &length);
  connected_ = problem == 0;
  if (!connected_) tryNextAddress(problem);
  return connected_;
}

short Connection::pollEvents() const {
  const bool writes = unsent() > 0 || !connected_;
  return static_cast<short>(writes ? POLLIN | POLLOUT : POLLIN);
}

void Connection::send(const v1::ClientMessage& message) {
  if (!disconnectReason_.empty()) return;
  const std::vector<std::uint8_t> bytes = encode(message);
  out_.insert(out_.end(), bytes.begin(), bytes.end());
  if (finishConnecting()) write();
}

void Connection::write() {
  while (unsent() > 0 && writeError_.empty()) {
    const ssize_t count = ::send(socket_, out_.data() + sent_, unsent(), MSG_NOSIGNAL);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) {
      // The server's last message explains more than the broken pipe, so it is read first.
      if (!wouldBlock(errno)) writeError_ = getErrorText(errno);
      break;
    }
    sent_ += static_cast<std::size_t>(count);
  }
  if (unsent() > 0 && sent_ < kCompactThreshold) return;
  out_.erase(out_.begin(), out_.begin() + static_cast<std::ptrdiff_t>(sent_));
  sent_ = 0;
}

/// Refills in_, whose bytes were all decoded. Returns false if no bytes arrived.
bool Connection::read() {
  in_.resize(kReadBytes);
  for (;;) {
    const ssize_t count = ::recv(socket_, in_.data(), in_.size(), 0);
    if (count > 0) {
      readCount_ = static_cast<std::size_t>(count);
      decodedCount_ = 0;
      return true;
    }
    if (count < 0 && errno == EINTR) continue;
    if (count == 0) {
      handleEndOfStream();
    } else if (!wouldBlock(errno)) {
      disconnect(peer_ + ": the connection broke: " + getErrorText(errno));
    } else if (!writeError_.empty()) {
      disconnect(peer_ + " closed the connection: " + writeError_);
    }
    return false;
  }
}

void Connection::handleEndOfStream() {
  if (!decoder_.magicSeen()) {
    return disconnect(peer_ +
                      " closed the connection before it answered; is that an Enfilade server?");
  }
  disconnect(peer_ + (decoder_.betweenMessages()
                          ? " closed the connection without a message: the server stopped or "
                            "disconnected this client; see the server's log"
                          : " closed the connection in the middle of a message (byte " +
                                std::to_string(decoder_.offset()) + "); was it killed?"));
}

void Connection::advance() {
  if (disconnectReason_.empty() && finishConnecting()) write();
}

std::optional<Received> Connection::next() {
  advance();
  for (;;) {
    std::span<const std::uint8_t> unread(in_.data() + decodedCount_, readCount_ - decodedCount_);
    auto framed = decoder_.next(unread);
    decodedCount_ = readCount_ - unread.size();
    if (decoder_.error()) {
      disconnect(peer_ + " does not speak this protocol: at byte " +
                 std::to_string(decoder_.error()->offset) + ": " + decoder_.error()->reason);
      return std::nullopt;
    }
    if (framed) {
      Received received;
      if (!parseHeader(framed->header, received.message)) {
        decodedCount_ = readCount_;
        disconnect(peer_ + " sent a message that is not a ServerMessage (before byte " +
                   std::to_string(decoder_.offset()) + "); do the versions match?");
        return std::nullopt;
      }
      received.attachment = std::move(framed->attachment);
      return received;
    }
    if (!disconnectReason_.empty() || !connected_ || !read()) return std::nullopt;
  }
}

bool Connection::waitFor(short events, std::chrono::steady_clock::time_point deadline) {
  constexpr long long kMaxPollMilliseconds = 1'000'000;  // milliseconds per poll()
  while (disconnectReason_.empty()) {
    const auto left =
        std::chrono::ceil<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now())
            .count();
    if (left < 0) return false;
    pollfd descriptor{socket_, events, 0};
    const int ready =
        ::poll(&descriptor, 1, static_cast<int>(std::min<long long>(left, kMaxPollMilliseconds)));
    if (ready > 0) return true;
    if (ready == 0 && std::chrono::steady_clock::now() >= deadline) return false;
    if (ready < 0 && errno != EINTR) {
      disconnect(peer_ + ": cannot wait for the socket: " + getErrorText(errno));
    }
  }
  return true;
}

// ---- greeting ----------------------------------------------------------------------------------

v1::ClientMessage makeHello(const std::string& clientName, const std::string& token) {
  v1::ClientMessage message;
  message.mutable_hello()->set_protocol_version(kVersion);
  message.mutable_hello()->set_client_name(clientName);
  message.mutable_hello()->set_token(token);
  return message;
}

v1::Error makeError(v1::ErrorCode code, const std::string& text, const std::string& field) {
  v1::Error error;
  error.set_code(code);
  error.set_message(text);
  error.set_field(field);
  return error;
}

std::optional<v1::Error> validateWelcome(const v1::ServerMessage& reply, const std::string& peer) {
  if (reply.has_error()) {
    const v1::Error& error = reply.error();
    return makeError(error.code(), peer + " refused the hello: " + error.message(), error.field());
  }
  const v1::Welcome& welcome = reply.welcome();
  if (!reply.has_welcome() || parseMajorVersion(welcome.protocol_version()) != kMajorVersion) {
    return makeError(v1::ERROR_VERSION,
                     peer + " speaks protocol version \"" + welcome.protocol_version() +
                         "\" and this client " + kVersion +
                         "; the major versions must be equal: use a client of the same release");
  }
  const double tick = welcome.policies().tick();
  if (!(tick > 0) || !std::isfinite(tick)) {
    return makeError(v1::ERROR_BAD_MESSAGE,
                     peer +
                         " sent a welcome whose tick length is not "
                         "positive",
                     "welcome.policies.tick");
  }
  return std::nullopt;
}

}  // namespace enfilade::protocol
