#include "server/net/session.hpp"

#include <spdlog/spdlog.h>

#include <boost/asio/post.hpp>

#include <utility>

#include "server/base/sanitize_for_log.hpp"
#include "server/messages/world_messages.hpp"

namespace enfilade::server {
namespace asio = boost::asio;

namespace {

Buffer magic() {
  return std::make_shared<const std::vector<std::uint8_t>>(protocol::kMagic.begin(),
                                                           protocol::kMagic.end());
}

Buffer goodbye(v1::ErrorCode code, const std::string& reason) {
  v1::ServerMessage message;
  message.mutable_bye()->set_code(code);
  message.mutable_bye()->set_reason(reason);
  return encodeShared(message);
}

v1::ErrorCode codeOf(protocol::FramingError::Code code) {
  return code == protocol::FramingError::Code::tooLarge ? v1::ERROR_TOO_LARGE
                                                        : v1::ERROR_BAD_MESSAGE;
}

/// So often a client that is not read is looked after: it may have gone.
constexpr std::chrono::seconds kLookForEnd{1};
constexpr std::size_t kLongestName = 64;  // bytes, of what a client calls itself or a world

}  // namespace

Session::Session(std::unique_ptr<Wire> wire, asio::any_io_executor executor, Reception& reception)
    : wire_(std::move(wire)),
      executor_(std::move(executor)),
      timer_(executor_),
      reception_(reception),
      peer_(wire_->peer()),
      decoder_(protocol::kServerTakes, wire_->beginsWithMagic()
                                           ? protocol::Decoder::Expect::magicFirst
                                           : protocol::Decoder::Expect::messages),
      pause_(executor_) {}

void Session::start(Timer::time_point deadline, std::string token) {
  token_ = std::move(token);
  const auto wake = [weak = weak_from_this(), executor = executor_] {
    asio::post(executor, [weak] {
      if (const auto self = weak.lock()) self->sendNext();
    });
  };
  const ServerLimits& limits = reception_.limits;
  out_ = std::make_shared<OutgoingQueue>(
      OutgoingBounds{limits.outgoingBytes, limits.outgoingFrames, limits.outgoingFrameBytes},
      goodbye(v1::ERROR_TOO_SLOW, "replies and events were not read: more than " +
                                      std::to_string(limits.outgoingBytes) + " bytes or " +
                                      std::to_string(limits.outgoingFrames) + " frames wait"),
      wake);
  allowance_ =
      std::make_shared<RequestAllowance>(limits, [weak = weak_from_this(), executor = executor_] {
        asio::post(executor, [weak] {
          if (const auto self = weak.lock()) self->pause_.cancel();
        });
      });
  if (wire_->beginsWithMagic()) out_->push(magic());
  armTimer(deadline, v1::ERROR_TIMEOUT, "no whole hello came in time");
  read();
}

// ---- in ----------------------------------------------------------------------------------------

void Session::read() {
  reading_ = true;
  wire_->read(
      [self = shared_from_this()](const std::string& problem, std::span<const std::uint8_t> bytes) {
        self->reading_ = false;
        if (!problem.empty()) return self->close(problem);
        self->takeBytes(bytes);
        self->keepReading();
      });
}

/// Reads on unless the client is ahead of its allowance; who ends is always heard.
void Session::keepReading() {
  if (closed_ || reading_) return;
  if (!listening_) return read();
  const bool room = allowance_->hasRoom();
  if (room && ahead_ <= RequestAllowance::Clock::duration::zero()) return read();
  // What is left to read is no more than the system keeps for a socket: the end stands behind it.
  if (wire_->peerEnded()) return read();
  pause(Timer::clock_type::now() +
        (room ? std::exchange(ahead_, {}) : RequestAllowance::Clock::duration(kLookForEnd)));
}

/// Reads nothing until then, or until the allowance wakes it. The wait keeps the session alive:
/// nothing else may be under way. What the client sent of a message is not timed meanwhile, since
/// it is the server that does not read.
void Session::pause(Timer::time_point end) {
  if (std::exchange(messageHalfway_, false)) timer_.expires_at(Timer::time_point::max());
  pause_.expires_at(end);
  reading_ = true;
  pause_.async_wait([self = shared_from_this()](ErrorCode) {
    self->reading_ = false;
    if (self->listening_ && !self->decoder_.betweenMessages()) self->timeHalfMessage();
    self->keepReading();
  });
}

void Session::timeHalfMessage() {
  messageHalfway_ = true;
  armTimer(Timer::clock_type::now() + reception_.limits.message, v1::ERROR_TIMEOUT,
           "half a message, then silence");
}

void Session::takeBytes(std::span<const std::uint8_t> bytes) {
  bool whole = false;
  while (listening_) {
    const auto message = decoder_.next(bytes);
    if (!message) break;
    whole = true;
    take(*message);
  }
  if (!listening_) return;
  if (const auto& error = decoder_.error()) {
    return fail(codeOf(error->code),
                error->reason + " (at byte " + std::to_string(error->offset) + ")");
  }
  const bool halfway = !decoder_.betweenMessages();
  if (client_ == 0 || (halfway && messageHalfway_ && !whole)) return;  // the timer runs on
  messageHalfway_ = halfway;
  timer_.expires_at(Timer::time_point::max());
  if (halfway) timeHalfMessage();
}

void Session::take(const protocol::Message& framed) {
  v1::ClientMessage message;
  if (!protocol::parse(framed.header, message)) {
    return fail(v1::ERROR_BAD_MESSAGE, "not a ClientMessage (the message that ends at byte " +
                                           std::to_string(decoder_.offset()) + ")");
  }
  if (message.request_id() == 0 && !message.has_bye()) {
    return fail(v1::ERROR_BAD_MESSAGE,
                "request_id: give a number above 0, so that it can be told "
                "which request an answer is to");
  }
  if (client_ == 0) return greet(message);
  // Answered like all else in its turn: what was asked before is told first.
  if (message.has_bye()) listening_ = false;
  ahead_ = allowance_->pace(RequestAllowance::Clock::now());
  world_->receive(client_, std::move(message),
                  allowance_->hold(framed.header.size() + framed.attachment.size()));
}

void Session::greet(const v1::ClientMessage& message) {
  const v1::Hello& hello = message.hello();
  if (!message.has_hello()) {
    return fail(v1::ERROR_BAD_MESSAGE, "the first message has to be hello", message.request_id());
  }
  if (protocol::majorOf(hello.protocol_version()) != protocol::kMajorVersion) {
    return fail(v1::ERROR_VERSION,
                "this server speaks protocol " + std::string(protocol::kVersion) + ", not '" +
                    printable(hello.protocol_version(), kLongestName) + "'",
                message.request_id());
  }
  if (hello.client_name().size() > kLongestName) {
    return fail(v1::ERROR_BAD_MESSAGE, "hello.client_name: give at most 64 bytes",
                message.request_id());
  }
  const auto role = roleOf(reception_.access, hello.token().empty() ? token_ : hello.token());
  if (!role) {
    return fail(v1::ERROR_UNAUTHENTICATED,
                hello.token().empty() && token_.empty()
                    ? "this server wants a token: give hello.token"
                    : "hello.token is none of this server's: ask whoever runs it for one",
                message.request_id());
  }
  if (!hello.client_name().empty())
    peer_ += " (" + printable(hello.client_name(), kLongestName) + ")";
  enter(hello, *role, message.request_id());
}

void Session::enter(const v1::Hello& hello, Role role, std::uint64_t requestId) {
  world_ = reception_.worlds.find(hello.world());
  if (world_) client_ = world_->join(hello.client_name(), role, out_, requestId);
  if (client_ != 0) return spdlog::info("{} came to world '{}'", peer_, world_->place().name);
  if (reception_.worlds.stopping())
    return fail(v1::ERROR_SHUTTING_DOWN, "the server ends", requestId);
  fail(v1::ERROR_UNKNOWN_WORLD,
       "there is no world '" + printable(hello.world(), kLongestName) +
           "', or it has ended: leave hello.world empty for the main one, and ask it by ListWorlds",
       requestId);
}

void Session::fail(v1::ErrorCode code, const std::string& reason, std::uint64_t requestId) {
  v1::ServerMessage message;
  message.set_reply_to(requestId);
  *message.mutable_error() = errorOf(code, reason);
  out_->push(encodeShared(message));
  end(code, reason);
}

void Session::end(v1::ErrorCode code, const std::string& reason) {
  if (!listening_) return;
  listening_ = false;
  spdlog::warn("{}: {}; disconnected", peer_, reason);
  out_->finish(goodbye(code, reason));
}

bool Session::giveWay() {
  if (client_ != 0 || !listening_) return false;
  close("it said nothing, and a newcomer takes its place");
  return true;
}

// ---- out ---------------------------------------------------------------------------------------

void Session::sendNext() {
  if (closed_) return;
  if (out_->finished()) sayGoodbye();
  if (sending_) return;
  OutgoingQueue::Next next = out_->pop();
  if (!next.message) return;
  sending_ = true;
  wire_->write(std::move(next.message),
               [self = shared_from_this(), last = next.last](const std::string& problem) {
                 self->written(problem, last);
               });
}

void Session::written(const std::string& problem, bool last) {
  sending_ = false;
  if (!problem.empty()) return close(problem);
  if (!last) return sendNext();
  // A socket closed with unread bytes would take the last words back (TCP resets); so the peer
  // closes first, or the farewell timer ends it.
  wire_->endSending([self = shared_from_this()] {});
}

/// The queue has its last words: they have limited time to get through.
void Session::sayGoodbye() {
  if (saidGoodbye_) return;
  saidGoodbye_ = true;
  if (listening_ && out_->overflowed()) {
    spdlog::warn("{}: too slow for its replies and events; disconnected", peer_);
  }
  listening_ = false;
  timer_.expires_after(reception_.limits.farewell);
  timer_.async_wait([self = shared_from_this()](ErrorCode problem) {
    if (!problem) self->close("it did not close in time");
  });
}

void Session::armTimer(Timer::time_point deadline, v1::ErrorCode code, std::string reason) {
  timer_.expires_at(deadline);
  timer_.async_wait([weak = weak_from_this(), code, reason = std::move(reason)](ErrorCode problem) {
    const auto self = weak.lock();
    if (problem || !self || !self->listening_) return;
    // One that ran out may stand in line behind the bytes that put it off.
    if (self->timer_.expiry() <= Timer::clock_type::now()) self->fail(code, reason);
  });
}

void Session::close(const std::string& why) {
  if (closed_) return;
  closed_ = true;
  if (listening_ || client_ != 0) spdlog::info("{} left: {}", peer_, why);
  listening_ = false;
  wire_->close();
  timer_.cancel();
  pause_.cancel();
  out_->finish(goodbye(v1::ERROR_UNSPECIFIED, "closed"));
  if (client_ != 0) world_->leave(client_);
}

}  // namespace enfilade::server
