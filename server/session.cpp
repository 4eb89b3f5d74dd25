#include "server/session.hpp"

#include <spdlog/spdlog.h>

#include <boost/asio/post.hpp>
#include <boost/asio/write.hpp>

#include "server/world_messages.hpp"

namespace enfilade::server {
namespace asio = boost::asio;
using asio::ip::tcp;

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

std::string addressOf(const tcp::socket& socket) {
  boost::system::error_code problem;
  const tcp::endpoint endpoint = socket.remote_endpoint(problem);
  if (problem) return "a client that is gone";
  return endpoint.address().to_string() + ":" + std::to_string(endpoint.port());
}

v1::ErrorCode codeOf(protocol::FramingError::Code code) {
  return code == protocol::FramingError::Code::tooLarge ? v1::ERROR_TOO_LARGE
                                                        : v1::ERROR_BAD_MESSAGE;
}

std::string printable(std::string text) {
  for (char& c : text) {
    if (c < ' ' || c > '~') c = '?';
  }
  return text;
}

}  // namespace

Session::Session(tcp::socket socket, TickLoop& loop, const ServerLimits& limits)
    : socket_(std::move(socket)),
      timer_(socket_.get_executor()),
      loop_(loop),
      limits_(limits),
      peer_(addressOf(socket_)),
      decoder_(protocol::kServerTakes) {}

void Session::start() {
  ErrorCode ignored;  // a peer that is gone already is told by the first read
  socket_.set_option(tcp::no_delay(true), ignored);
  socket_.set_option(asio::socket_base::keep_alive(true), ignored);
  if (limits_.sendBuffer > 0) {
    socket_.set_option(asio::socket_base::send_buffer_size(limits_.sendBuffer), ignored);
  }
  const auto wake = [weak = weak_from_this(), executor = socket_.get_executor()] {
    asio::post(executor, [weak] {
      if (const auto self = weak.lock()) self->sendNext();
    });
  };
  out_ = std::make_shared<OutgoingQueue>(
      OutgoingBounds{limits_.outgoingBytes, limits_.outgoingFrames},
      goodbye(v1::ERROR_TOO_SLOW, "replies and events were not read: more than " +
                                      std::to_string(limits_.outgoingBytes) + " bytes or " +
                                      std::to_string(limits_.outgoingFrames) + " frames wait"),
      wake);
  out_->push(magic());
  armTimer(limits_.greeting, v1::ERROR_TIMEOUT, "no whole hello came in time");
  read();
}

// ---- in ----------------------------------------------------------------------------------------

void Session::read() {
  socket_.async_read_some(asio::buffer(in_),
                          [self = shared_from_this()](ErrorCode problem, std::size_t bytes) {
                            if (problem) return self->close(problem.message());
                            self->takeBytes({self->in_.data(), bytes});
                            if (!self->closed_) self->read();
                          });
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
  if (halfway) armTimer(limits_.message, v1::ERROR_TIMEOUT, "half a message, then silence");
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
  if (message.has_bye()) return close("it said goodbye");
  loop_.receive(client_, std::move(message), framed.header.size() + framed.attachment.size());
}

void Session::greet(const v1::ClientMessage& message) {
  constexpr std::size_t kLongestName = 64;
  const v1::Hello& hello = message.hello();
  if (!message.has_hello()) {
    return fail(v1::ERROR_BAD_MESSAGE, "the first message has to be hello", message.request_id());
  }
  if (protocol::majorOf(hello.protocol_version()) != protocol::kMajorVersion) {
    return fail(v1::ERROR_VERSION,
                "this server speaks protocol " + std::string(protocol::kVersion) + ", not '" +
                    printable(hello.protocol_version().substr(0, kLongestName)) + "'",
                message.request_id());
  }
  if (hello.client_name().size() > kLongestName) {
    return fail(v1::ERROR_BAD_MESSAGE, "hello.client_name: give at most 64 bytes",
                message.request_id());
  }
  if (!hello.client_name().empty()) peer_ += " (" + printable(hello.client_name()) + ")";
  client_ = loop_.join(hello.client_name(), out_, message.request_id());
  spdlog::info("{} came", peer_);
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

// ---- out ---------------------------------------------------------------------------------------

void Session::sendNext() {
  if (closed_) return;
  if (out_->finished()) sayGoodbye();
  if (sending_) return;
  const OutgoingQueue::Next next = out_->pop();
  if (!next.message) return;
  sending_ = next.message;
  asio::async_write(socket_, asio::buffer(*sending_),
                    [self = shared_from_this(), last = next.last](ErrorCode problem, std::size_t) {
                      self->written(problem, last);
                    });
}

void Session::written(ErrorCode problem, bool last) {
  sending_.reset();
  if (problem) return close(problem.message());
  if (!last) return sendNext();
  // A socket closed with unread bytes would take the last words back (TCP resets); so the peer
  // closes first, or the farewell timer ends it.
  socket_.shutdown(tcp::socket::shutdown_send, problem);
}

/// The queue has its last words: they have limited time to get through.
void Session::sayGoodbye() {
  if (saidGoodbye_) return;
  saidGoodbye_ = true;
  if (listening_ && out_->overflowed()) {
    spdlog::warn("{}: too slow for its replies and events; disconnected", peer_);
  }
  listening_ = false;
  timer_.expires_after(limits_.farewell);
  timer_.async_wait([self = shared_from_this()](ErrorCode problem) {
    if (!problem) self->close("it did not close in time");
  });
}

void Session::armTimer(std::chrono::milliseconds time, v1::ErrorCode code, std::string reason) {
  timer_.expires_after(time);
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
  ErrorCode ignored;
  socket_.close(ignored);
  timer_.cancel();
  out_->finish(goodbye(v1::ERROR_UNSPECIFIED, "closed"));
  if (client_ != 0) loop_.leave(client_);
}

}  // namespace enfilade::server
