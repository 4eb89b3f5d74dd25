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
#include <cmath>
#include <cstring>
#include <memory>
#include <system_error>

namespace enfilade::protocol {
namespace {

constexpr std::size_t kReadAtOnce = 1 << 16;   // bytes
constexpr std::size_t kForgetAbove = 1 << 16;  // bytes sent that are still held

constexpr const char* kRemedy =
    "; is `enfilade serve` running there, and is the port the one of its ready line?";

std::string textOf(int error) {
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

void Connection::breakOff(const std::string& reason) {
  if (!broken_.empty()) return;
  broken_ = reason;
  if (socket_ >= 0) ::close(socket_);
  socket_ = -1;
}

void Connection::connect(const std::string& host, std::uint16_t port) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* list = nullptr;
  const int unknown = ::getaddrinfo(host.c_str(), std::to_string(port).c_str(), &hints, &list);
  if (unknown != 0) {
    return breakOff("cannot connect to " + peer_ + ": " + ::gai_strerror(unknown) +
                    "; give a name that this machine can look up, or an address in numbers");
  }
  const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> addresses(list, &::freeaddrinfo);
  for (const addrinfo* one = list; one; one = one->ai_next) {
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(one->ai_addr);
    addresses_.emplace_back(bytes, bytes + one->ai_addrlen);
  }
  tryNext(0);
}

/// The next address that answers at once or may answer later; `problem`: of the one before.
void Connection::tryNext(int problem) {
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
  breakOff("cannot connect to " + peer_ + ": " + textOf(problem) + kRemedy);
}

/// False while the other side has not answered.
bool Connection::finishConnecting() {
  if (connected_) return true;
  pollfd descriptor{socket_, POLLOUT, 0};
  if (::poll(&descriptor, 1, 0) <= 0) return false;
  int problem = 0;
  socklen_t length = sizeof problem;
  ::getsockopt(socket_, SOL_SOCKET, SO_ERROR, &problem, &length);
  connected_ = problem == 0;
  if (!connected_) tryNext(problem);
  return connected_;
}

short Connection::wanted() const {
  const bool writes = unsent() > 0 || !connected_;
  return static_cast<short>(writes ? POLLIN | POLLOUT : POLLIN);
}

void Connection::send(const v1::ClientMessage& message) {
  if (!broken_.empty()) return;
  const std::vector<std::uint8_t> bytes = encode(message);
  out_.insert(out_.end(), bytes.begin(), bytes.end());
  if (finishConnecting()) write();
}

void Connection::write() {
  while (unsent() > 0 && writeProblem_.empty()) {
    const ssize_t count = ::send(socket_, out_.data() + sent_, unsent(), MSG_NOSIGNAL);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) {
      // What the server said last is worth more than the broken pipe: it is read first.
      if (!wouldBlock(errno)) writeProblem_ = textOf(errno);
      break;
    }
    sent_ += static_cast<std::size_t>(count);
  }
  if (unsent() > 0 && sent_ < kForgetAbove) return;
  out_.erase(out_.begin(), out_.begin() + static_cast<std::ptrdiff_t>(sent_));
  sent_ = 0;
}

/// Fills in_, of which all was taken; false when nothing came.
bool Connection::read() {
  in_.resize(kReadAtOnce);
  for (;;) {
    const ssize_t count = ::recv(socket_, in_.data(), in_.size(), 0);
    if (count > 0) {
      count_ = static_cast<std::size_t>(count);
      taken_ = 0;
      return true;
    }
    if (count < 0 && errno == EINTR) continue;
    if (count == 0) {
      endOfStream();
    } else if (!wouldBlock(errno)) {
      breakOff(peer_ + ": the connection broke: " + textOf(errno));
    } else if (!writeProblem_.empty()) {
      breakOff(peer_ + " closed the connection: " + writeProblem_);
    }
    return false;
  }
}

void Connection::endOfStream() {
  if (!decoder_.magicSeen()) {
    return breakOff(peer_ +
                    " closed the connection before it answered; is that an Enfilade server?");
  }
  breakOff(peer_ + (decoder_.betweenMessages()
                        ? " closed the connection without a word: it was ended, or cut this client "
                          "off; its log may say why"
                        : " closed the connection in the middle of a message (byte " +
                              std::to_string(decoder_.offset()) + "); was it killed?"));
}

void Connection::advance() {
  if (broken_.empty() && finishConnecting()) write();
}

std::optional<Received> Connection::next() {
  advance();
  for (;;) {
    std::span<const std::uint8_t> unread(in_.data() + taken_, count_ - taken_);
    auto framed = decoder_.next(unread);
    taken_ = count_ - unread.size();
    if (decoder_.error()) {
      breakOff(peer_ + " does not speak this protocol: at byte " +
               std::to_string(decoder_.error()->offset) + ": " + decoder_.error()->reason);
      return std::nullopt;
    }
    if (framed) {
      Received received;
      if (!parse(framed->header, received.message)) {
        taken_ = count_;
        breakOff(peer_ + " sent a message that is not a ServerMessage (before byte " +
                 std::to_string(decoder_.offset()) + "); do the versions fit?");
        return std::nullopt;
      }
      received.attachment = std::move(framed->attachment);
      return received;
    }
    if (!broken_.empty() || !connected_ || !read()) return std::nullopt;
  }
}

bool Connection::await(short what, std::chrono::steady_clock::time_point deadline) {
  using Clock = std::chrono::steady_clock;
  constexpr long long kLongest = 1'000'000;  // milliseconds of one poll
  while (broken_.empty()) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now()).count();
    if (left < 0) return false;
    pollfd descriptor{socket_, what, 0};
    const int ready = ::poll(&descriptor, 1, static_cast<int>(std::min<long long>(left, kLongest)));
    if (ready > 0) return true;
    if (ready == 0 && Clock::now() >= deadline) return false;
    if (ready < 0 && errno != EINTR) {
      breakOff(peer_ + ": cannot wait for the socket: " + textOf(errno));
    }
  }
  return true;
}

// ---- greeting ----------------------------------------------------------------------------------

v1::ClientMessage helloOf(const std::string& clientName, const std::string& token) {
  v1::ClientMessage message;
  message.mutable_hello()->set_protocol_version(kVersion);
  message.mutable_hello()->set_client_name(clientName);
  message.mutable_hello()->set_token(token);
  return message;
}

namespace {

v1::Error problemOf(v1::ErrorCode code, const std::string& text, const std::string& field = {}) {
  v1::Error error;
  error.set_code(code);
  error.set_message(text);
  error.set_field(field);
  return error;
}

}  // namespace

std::optional<v1::Error> welcomeProblem(const v1::ServerMessage& answer, const std::string& peer) {
  if (answer.has_error()) {
    const v1::Error& error = answer.error();
    return problemOf(error.code(), peer + " refused the greeting: " + error.message(),
                     error.field());
  }
  const v1::Welcome& welcome = answer.welcome();
  if (!answer.has_welcome() || majorOf(welcome.protocol_version()) != kMajorVersion) {
    return problemOf(v1::ERROR_VERSION,
                     peer + " speaks protocol version \"" + welcome.protocol_version() +
                         "\" and this client " + kVersion +
                         "; the first numbers must be equal: use a client of its release");
  }
  const double tick = welcome.policies().tick();
  if (!(tick > 0) || !std::isfinite(tick)) {
    return problemOf(v1::ERROR_BAD_MESSAGE, peer + " greets with a tick that is not positive",
                     "welcome.policies.tick");
  }
  return std::nullopt;
}

}  // namespace enfilade::protocol
