#include "server/net/session.hpp"

#include <algorithm>
#include <boost/asio/post.hpp>
#include <span>
#include <utility>

#include "collision/assert.hpp"
#include "server/hosting/world_lifecycle.hpp"
#include "server/log/log.hpp"
#include "server/log/sanitize_for_log.hpp"
#include "server/messages/world_messages.hpp"

namespace enfilade::server {
namespace asio = boost::asio;

namespace {

Buffer makeMagic() {
  return std::make_shared<const std::vector<std::uint8_t>>(protocol::kMagic.begin(),
                                                           protocol::kMagic.end());
}

v1::ErrorCode toErrorCode(protocol::FramingError::Code code) {
  return code == protocol::FramingError::Code::tooLarge ? v1::ERROR_TOO_LARGE
                                                        : v1::ERROR_BAD_MESSAGE;
}

/// Period of disconnect checks while a client is not read.
constexpr std::chrono::seconds kDisconnectPollPeriod{1};
constexpr std::size_t kMaxNameBytes = 64;  // bytes, of names of clients and worlds

std::string listWorlds(const WorldRegistry& worlds) {
  constexpr std::size_t kMaxListed = 10;
  const auto all = worlds.allWorlds();
  std::string list;
  for (const auto& world : std::span(all).first(std::min(kMaxListed, all.size())))
    list += (list.empty() ? "'" : ", '") + world->identity().name + "'";
  return list + (all.size() > kMaxListed ? ", ..." : "");
}

}  // namespace

Session::Session(std::unique_ptr<Transport> transport, asio::any_io_executor executor,
                 ServerContext& context)
    : transport_(std::move(transport)),
      executor_(std::move(executor)),
      timer_(executor_),
      context_(context),
      peer_(transport_->peer()),
      decoder_(protocol::kServerLimits, transport_->usesMagic()
                                            ? protocol::Decoder::Expect::magicFirst
                                            : protocol::Decoder::Expect::messages),
      pauseTimer_(executor_) {}

void Session::start(Timer::time_point deadline, std::string token) {
  token_ = std::move(token);
  const auto wake = [weak = weak_from_this(), executor = executor_] {
    asio::post(executor, [weak] {
      if (const auto self = weak.lock()) self->sendNext();
    });
  };
  const ServerLimits& limits = context_.limits;
  out_ = std::make_shared<OutgoingQueue>(
      makeOutgoingLimits(context_),
      encodeBye(
          makeBye(v1::ERROR_TOO_SLOW, "replies and events were not read in time: more than " +
                                          std::to_string(limits.outgoingBytes) + " bytes or " +
                                          std::to_string(limits.outgoingFrames) + " frames wait")),
      wake);
  flowControl_ =
      std::make_shared<FlowControl>(limits, [weak = weak_from_this(), executor = executor_] {
        asio::post(executor, [weak] {
          if (const auto self = weak.lock()) self->pauseTimer_.cancel();
        });
      });
  if (transport_->usesMagic()) out_->push(makeMagic());
  armTimer(deadline, v1::ERROR_TIMEOUT, "no complete hello before the deadline");
  read();
}

// ---- receive -----------------------------------------------------------------------------------

void Session::read() {
  ENFILADE_ASSERT(!reading_ && !closed_);
  reading_ = true;
  transport_->read(
      [self = shared_from_this()](const std::string& problem, std::span<const std::uint8_t> bytes) {
        self->reading_ = false;
        if (!problem.empty()) return self->close(problem);
        self->handleBytes(bytes);
        self->continueReading();
      });
}

/// Continues to read unless flow control delays the client. A disconnect is always noticed.
void Session::continueReading() {
  if (closed_ || reading_) return;
  if (!listening_) return read();
  const bool hasCapacity = flowControl_->hasCapacity();
  if (hasCapacity && debt_ <= FlowControl::Clock::duration::zero()) return read();
  // After the peer's end, at most the socket's receive buffer is left: no need to delay.
  if (transport_->peerClosed()) return read();
  pauseReading(Timer::clock_type::now() +
               (hasCapacity ? std::exchange(debt_, {})
                            : FlowControl::Clock::duration(kDisconnectPollPeriod)));
}

/// Stops reading until `end`, or until flow control wakes it. The timer's handler keeps the session
/// alive: no other operation may be in progress. Message timeouts are suspended, because the server
/// does not read.
void Session::pauseReading(Timer::time_point end) {
  ENFILADE_ASSERT(!reading_ && !closed_);
  if (std::exchange(messageIncomplete_, false)) timer_.expires_at(Timer::time_point::max());
  pauseTimer_.expires_at(end);
  reading_ = true;
  pauseTimer_.async_wait([self = shared_from_this()](ErrorCode) {
    self->reading_ = false;
    if (self->listening_ && !self->decoder_.betweenMessages()) self->startMessageTimer();
    self->continueReading();
  });
}

void Session::startMessageTimer() {
  messageIncomplete_ = true;
  armTimer(Timer::clock_type::now() + context_.limits.messageTimeout, v1::ERROR_TIMEOUT,
           "incomplete message, then no data");
}

void Session::handleBytes(std::span<const std::uint8_t> bytes) {
  bool anyComplete = false;
  while (listening_) {
    const auto message = decoder_.next(bytes);
    if (!message) break;
    anyComplete = true;
    handleMessage(*message);
  }
  if (!listening_) return;
  if (const auto& error = decoder_.error()) {
    return fail(toErrorCode(error->code),
                error->reason + " (at byte " + std::to_string(error->offset) + ")");
  }
  const bool incomplete = !decoder_.betweenMessages();
  if (client_ == 0 || (incomplete && messageIncomplete_ && !anyComplete))
    return;  // the timer continues
  messageIncomplete_ = incomplete;
  timer_.expires_at(Timer::time_point::max());
  if (incomplete) startMessageTimer();
}

void Session::handleMessage(const protocol::Message& framed) {
  v1::ClientMessage message;
  if (!protocol::parseHeader(framed.header, message)) {
    return fail(v1::ERROR_BAD_MESSAGE, "not a ClientMessage (the message that ends at byte " +
                                           std::to_string(decoder_.offset()) + ")");
  }
  if (message.request_id() == 0 && !message.has_bye()) {
    return fail(v1::ERROR_BAD_MESSAGE,
                "request_id: give a number above 0, so that replies can be "
                "matched to requests");
  }
  if (client_ == 0) return handleHello(message);
  ENFILADE_ASSERT(world_);
  // Bye is answered in order, after the replies to earlier requests.
  if (message.has_bye()) listening_ = false;
  debt_ = flowControl_->throttle(FlowControl::Clock::now());
  world_->receive(client_, std::move(message),
                  flowControl_->acquire(framed.header.size() + framed.attachment.size()));
}

void Session::handleHello(const v1::ClientMessage& message) {
  const v1::Hello& hello = message.hello();
  if (!message.has_hello()) {
    return fail(v1::ERROR_BAD_MESSAGE, "the first message has to be hello", message.request_id());
  }
  if (protocol::parseMajorVersion(hello.protocol_version()) != protocol::kMajorVersion) {
    return fail(v1::ERROR_VERSION,
                "this server speaks protocol " + std::string(protocol::kVersion) + ", not '" +
                    sanitizeForLog(hello.protocol_version(), kMaxNameBytes) + "'",
                message.request_id());
  }
  if (hello.client_name().size() > kMaxNameBytes) {
    return fail(v1::ERROR_BAD_MESSAGE, "hello.client_name: give at most 64 bytes",
                message.request_id());
  }
  const auto role = findRole(context_.access, hello.token().empty() ? token_ : hello.token());
  if (!role) {
    return fail(v1::ERROR_UNAUTHENTICATED,
                hello.token().empty() && token_.empty()
                    ? "this server requires a token: give hello.token"
                    : "hello.token is unknown: ask the server's operator for a token",
                message.request_id());
  }
  if (!hello.client_name().empty())
    peer_ += " (" + sanitizeForLog(hello.client_name(), kMaxNameBytes) + ")";
  joinWorld(hello, *role, message.request_id());
}

void Session::joinWorld(const v1::Hello& hello, Role role, std::uint64_t requestId) {
  world_ = context_.worlds.find(hello.world());
  if (world_) client_ = world_->join(hello.client_name(), role, out_, requestId);
  if (client_ != 0) return logInfo("{} entered world '{}'", peer_, world_->identity().name);
  if (context_.worlds.isStopping())
    return fail(v1::ERROR_SHUTTING_DOWN, "the server is stopping", requestId);
  fail(v1::ERROR_UNKNOWN_WORLD,
       "there is no world '" + sanitizeForLog(hello.world(), kMaxNameBytes) +
           "', or it has ended: the worlds are " + listWorlds(context_.worlds),
       requestId);
}

void Session::fail(v1::ErrorCode code, const std::string& reason, std::uint64_t requestId) {
  v1::ServerMessage message;
  message.set_reply_to(requestId);
  *message.mutable_error() = makeError(code, reason);
  out_->push(encodeShared(message));
  end(code, reason);
}

void Session::end(v1::ErrorCode code, const std::string& reason) {
  if (!listening_) return;
  listening_ = false;
  logWarning("{}: {}; disconnected", peer_, reason);
  out_->finish(encodeBye(makeBye(code, reason)));
}

bool Session::evictIfAnonymous() {
  if (client_ != 0 || !listening_) return false;
  close("it sent no hello and was replaced by a new connection");
  return true;
}

// ---- send --------------------------------------------------------------------------------------

void Session::sendNext() {
  if (closed_) return;
  if (out_->finished()) startCloseTimer();
  if (sending_) return;
  OutgoingQueue::Next next = out_->pop();
  if (!next.message) return;
  sending_ = true;
  transport_->write(std::move(next.message),
                    [self = shared_from_this(), last = next.last](const std::string& problem) {
                      self->onWritten(problem, last);
                    });
}

void Session::onWritten(const std::string& problem, bool last) {
  ENFILADE_ASSERT(sending_);
  sending_ = false;
  if (!problem.empty()) return close(problem);
  if (!last) return sendNext();
  // Closing a socket with unread bytes resets TCP and discards the final message. So the peer
  // closes first, or the close timer ends the connection.
  transport_->shutdownSend([self = shared_from_this()] {});
}

/// Limits the time to deliver the final message.
void Session::startCloseTimer() {
  if (closeTimerStarted_) return;
  closeTimerStarted_ = true;
  if (listening_ && out_->overflowed()) {
    logWarning("{}: too slow for its replies and events; disconnected", peer_);
  }
  listening_ = false;
  timer_.expires_after(context_.limits.closeTimeout);
  timer_.async_wait([self = shared_from_this()](ErrorCode problem) {
    if (!problem) self->close("it did not close in time");
  });
}

void Session::armTimer(Timer::time_point deadline, v1::ErrorCode code, std::string reason) {
  timer_.expires_at(deadline);
  timer_.async_wait([weak = weak_from_this(), code, reason = std::move(reason)](ErrorCode problem) {
    const auto self = weak.lock();
    if (problem || !self || !self->listening_) return;
    // An expired timer may be queued behind bytes that extended its deadline.
    if (self->timer_.expiry() <= Timer::clock_type::now()) self->fail(code, reason);
  });
}

void Session::close(const std::string& reason) {
  if (closed_) return;
  closed_ = true;
  if (listening_ || client_ != 0) logInfo("{} left: {}", peer_, reason);
  listening_ = false;
  transport_->close();
  timer_.cancel();
  pauseTimer_.cancel();
  out_->finish(encodeBye(makeBye(v1::ERROR_UNSPECIFIED, "closed")));
  if (client_ != 0) world_->leave(client_);
}

}  // namespace enfilade::server
