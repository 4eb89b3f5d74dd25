#include "protocol/client.hpp"

#include <poll.h>

#include <array>
#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <utility>

namespace enfilade::protocol {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using Clock = std::chrono::steady_clock;
using boost::system::error_code;

std::string secondsText(std::chrono::milliseconds time) {
  const auto count = time.count();
  return count % 1000 == 0 ? std::to_string(count / 1000) + " s" : std::to_string(count) + " ms";
}

struct Received {
  v1::ServerMessage message;
  std::vector<std::uint8_t> attachment;
};

}  // namespace

ProtocolError::ProtocolError(v1::ErrorCode errorCode, const std::string& message,
                             std::string errorField)
    : std::runtime_error(message), code(errorCode), field(std::move(errorField)) {}

std::span<const std::uint8_t> ReceivedFrame::plane(v1::Channel channel) const {
  for (const v1::Plane& plane : description.planes()) {
    if (plane.channel() == channel) {
      return std::span(pixels).subspan(plane.offset(), plane.length());
    }
  }
  return {};
}

// ---- the connection ----------------------------------------------------------------------------

struct Client::State {
  State(const std::string& host, std::uint16_t port, const ClientOptions& clientOptions)
      : peer(host + ":" + std::to_string(port)),
        options(clientOptions),
        decoder(clientOptions.limits) {}

  void connect(const std::string& host, std::uint16_t port);
  void greet();
  void send(const v1::ClientMessage& message, Clock::time_point deadline);
  void write(std::span<const std::uint8_t> bytes, Clock::time_point deadline);
  bool awaitSocket(short what, Clock::time_point deadline);
  std::optional<Received> receive(Clock::time_point deadline);
  bool readSome(Clock::time_point deadline);
  Received parsed(Message message);
  void keepUnasked(v1::ServerMessage message);
  [[noreturn]] void breakOff(const std::string& reason);
  void throwIfBroken() const;

  std::string peer;
  ClientOptions options;
  asio::io_context context;
  tcp::socket socket{context};
  Decoder decoder;
  std::array<std::uint8_t, 1 << 16> buffer{};
  std::span<const std::uint8_t> unread;  ///< of `buffer`
  std::deque<v1::ServerMessage> events;
  v1::Welcome welcome;
  std::uint64_t lastId = 0;
  std::string broken;  ///< not empty: why the connection is of no more use
};

void Client::State::breakOff(const std::string& reason) {
  broken = reason;
  error_code ignored;
  socket.close(ignored);
  throw ConnectionError(broken);
}

void Client::State::throwIfBroken() const {
  if (!broken.empty()) throw ConnectionError(broken);
}

void Client::State::connect(const std::string& host, std::uint16_t port) {
  error_code problem = asio::error::timed_out;
  tcp::resolver resolver(context);
  resolver.async_resolve(
      host, std::to_string(port),
      [&](const error_code& resolveProblem, const tcp::resolver::results_type& addresses) {
        problem = resolveProblem;
        if (problem) return;
        problem = asio::error::timed_out;
        asio::async_connect(socket, addresses,
                            [&](const error_code& connectProblem, const tcp::endpoint&) {
                              problem = connectProblem;
                            });
      });
  context.run_for(options.timeout);
  if (!context.stopped()) {
    resolver.cancel();
    error_code ignored;
    socket.close(ignored);
    context.run();
    problem = asio::error::timed_out;
  }
  if (problem) {
    breakOff("cannot connect to " + peer + ": " + problem.message() +
             "; is `enfilade serve` running there, and is the port the one of its ready line?");
  }
  socket.set_option(tcp::no_delay(true));
  socket.non_blocking(true);
}

/// False when the deadline came first.
bool Client::State::awaitSocket(short what, Clock::time_point deadline) {
  for (;;) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now());
    if (left.count() < 0) return false;
    pollfd descriptor{socket.native_handle(), what, 0};
    constexpr long long longest = 1'000'000;
    const int ready =
        ::poll(&descriptor, 1, static_cast<int>(std::min<long long>(left.count(), longest)));
    if (ready > 0) return true;
    if (ready == 0 && Clock::now() >= deadline) return false;
    if (ready < 0 && errno != EINTR) {
      breakOff(peer + ": cannot wait for the socket: " +
               error_code(errno, boost::system::system_category()).message());
    }
  }
}

void Client::State::write(std::span<const std::uint8_t> bytes, Clock::time_point deadline) {
  while (!bytes.empty()) {
    error_code problem;
    const std::size_t count = socket.write_some(asio::buffer(bytes.data(), bytes.size()), problem);
    bytes = bytes.subspan(count);
    if (problem == asio::error::would_block) {
      if (!awaitSocket(POLLOUT, deadline)) {
        breakOff(peer + " took nothing for " + secondsText(options.timeout) +
                 "; is the server stopped or overloaded?");
      }
    } else if (problem) {
      // What the server said last is worth more than the broken pipe.
      while (auto received = receive(Clock::now())) {
        if (received->message.reply_to() == 0) keepUnasked(std::move(received->message));
        throwIfBroken();
      }
      breakOff(peer + " closed the connection: " + problem.message());
    }
  }
}

void Client::State::send(const v1::ClientMessage& message, Clock::time_point deadline) {
  write(encode(message), deadline);
}

/// Fills `buffer`, of which nothing is unread; false when the deadline came first.
bool Client::State::readSome(Clock::time_point deadline) {
  for (;;) {
    error_code problem;
    const std::size_t count = socket.read_some(asio::buffer(buffer), problem);
    if (!problem) {
      unread = std::span<const std::uint8_t>(buffer).first(count);
      return true;
    }
    if (problem == asio::error::would_block) {
      if (!awaitSocket(POLLIN, deadline)) return false;
    } else if (problem == asio::error::eof && !decoder.magicSeen()) {
      breakOff(peer + " closed the connection before it answered; is that an Enfilade server?");
    } else if (problem == asio::error::eof) {
      breakOff(peer + (decoder.betweenMessages()
                           ? " closed the connection; its log says why"
                           : " closed the connection in the middle of a message (byte " +
                                 std::to_string(decoder.offset()) + "); its log says why"));
    } else {
      breakOff(peer + ": the connection broke: " + problem.message());
    }
  }
}

/// The next message; nullopt when the deadline came first (what came of it is kept).
std::optional<Received> Client::State::receive(Clock::time_point deadline) {
  for (;;) {
    if (auto message = decoder.next(unread)) return parsed(std::move(*message));
    if (decoder.error()) {
      breakOff(peer + " does not speak this protocol: at byte " +
               std::to_string(decoder.error()->offset) + ": " + decoder.error()->reason);
    }
    if (!readSome(deadline)) return std::nullopt;
  }
}

Received Client::State::parsed(Message message) {
  Received received;
  if (!parse(message.header, received.message)) {
    breakOff(peer + " sent a message that is not a ServerMessage (before byte " +
             std::to_string(decoder.offset()) + "); do the versions fit?");
  }
  received.attachment = std::move(message.attachment);
  return received;
}

/// Queues an event. After a Bye, which is the last, the connection is broken; errors of the
/// connection are thrown.
void Client::State::keepUnasked(v1::ServerMessage message) {
  if (message.has_error()) {
    const v1::Error& error = message.error();
    broken = peer + " ended the connection: " + error.message();
    throw ProtocolError(error.code(), broken, error.field());
  }
  if (message.has_bye()) {
    const std::string& reason = message.bye().reason();
    broken = peer + " said goodbye: " + (reason.empty() ? "no reason given" : reason);
  }
  events.push_back(std::move(message));
}

void Client::State::greet() {
  const auto deadline = Clock::now() + options.timeout;
  write(kMagic, deadline);
  v1::ClientMessage hello;
  hello.set_request_id(++lastId);
  hello.mutable_hello()->set_protocol_version(kVersion);
  hello.mutable_hello()->set_client_name(options.name);
  hello.mutable_hello()->set_token(options.token);
  hello.mutable_hello()->set_world(options.world);
  send(hello, deadline);
  const auto received = receive(deadline);
  if (!received) {
    breakOff(peer + " did not answer the greeting within " + secondsText(options.timeout) +
             "; is that an Enfilade server?");
  }
  if (received->message.has_error()) {
    const v1::Error& error = received->message.error();
    throw ProtocolError(error.code(), peer + " refused the greeting: " + error.message(),
                        error.field());
  }
  if (received->message.has_bye()) {
    breakOff(peer + " refused the connection: " + received->message.bye().reason());
  }
  welcome = received->message.welcome();
  if (!received->message.has_welcome() || majorOf(welcome.protocol_version()) != kMajorVersion) {
    throw ProtocolError(v1::ERROR_VERSION,
                        peer + " speaks protocol version \"" + welcome.protocol_version() +
                            "\" and this client " + kVersion +
                            "; the first numbers must be equal: use a client of its release");
  }
  const double tick = welcome.policies().tick();
  if (!(tick > 0) || !std::isfinite(tick)) {
    throw ProtocolError(v1::ERROR_BAD_MESSAGE, peer + " greets with a tick that is not positive",
                        "welcome.policies.tick");
  }
}

// ---- the client --------------------------------------------------------------------------------

Client::Client(const std::string& host, std::uint16_t port, const ClientOptions& options)
    : state_(std::make_unique<State>(host, port, options)) {
  state_->connect(host, port);
  state_->greet();
}

Client::~Client() {
  if (!state_ || !state_->broken.empty()) return;
  v1::ClientMessage bye;
  bye.set_request_id(++state_->lastId);
  bye.mutable_bye();
  try {
    state_->send(bye, Clock::now() + std::chrono::milliseconds(100));
  } catch (const std::exception&) {
    // The connection ends either way.
  }
}

Client::Client(Client&&) noexcept = default;
Client& Client::operator=(Client&&) noexcept = default;

const v1::Welcome& Client::welcome() const {
  return state_->welcome;
}

v1::ServerMessage Client::request(v1::ClientMessage message,
                                  std::vector<std::uint8_t>* attachment) {
  state_->throwIfBroken();
  const auto deadline = Clock::now() + state_->options.timeout;
  const std::uint64_t id = ++state_->lastId;
  message.set_request_id(id);
  state_->send(message, deadline);
  for (;;) {
    auto received = state_->receive(deadline);
    if (!received) {
      state_->breakOff(state_->peer + " did not answer within " +
                       secondsText(state_->options.timeout) +
                       "; is it overloaded? A longer timeout may help");
    }
    if (received->message.reply_to() == 0) {
      state_->keepUnasked(std::move(received->message));
      state_->throwIfBroken();
      continue;
    }
    if (received->message.reply_to() != id) {
      state_->breakOff(state_->peer + " answered request " +
                       std::to_string(received->message.reply_to()) + " instead of " +
                       std::to_string(id));
    }
    if (received->message.has_error()) {
      const v1::Error& error = received->message.error();
      throw ProtocolError(error.code(), error.message(), error.field());
    }
    if (attachment) *attachment = std::move(received->attachment);
    return std::move(received->message);
  }
}

namespace {

/// Throws when the reply is not of the kind that was asked for.
void expectBody(const v1::ServerMessage& reply, v1::ServerMessage::BodyCase wanted,
                const char* name) {
  if (reply.body_case() != wanted) {
    throw ProtocolError(v1::ERROR_BAD_MESSAGE, std::string("the server's reply is not a ") + name +
                                                   "; do the versions fit?");
  }
}

}  // namespace

std::optional<v1::Error> Client::command(const v1::Command& command) {
  v1::ClientMessage message;
  *message.mutable_command() = command;
  return tell(std::move(message));
}

std::optional<v1::Error> Client::bodyCommand(const v1::BodyCommand& command) {
  v1::ClientMessage message;
  *message.mutable_body_command() = command;
  return tell(std::move(message));
}

std::optional<v1::Error> Client::tell(v1::ClientMessage message) {
  v1::ServerMessage reply;
  try {
    reply = request(std::move(message));
  } catch (const ProtocolError& problem) {
    if (!state_->broken.empty()) throw;
    v1::Error error;
    error.set_code(problem.code);
    error.set_message(problem.what());
    error.set_field(problem.field);
    return error;
  }
  expectBody(reply, v1::ServerMessage::kCommand, "CommandReply");
  if (reply.command().accepted()) return std::nullopt;
  return std::move(*reply.mutable_command()->mutable_error());
}

v1::StepReply Client::step(std::uint32_t ticks, bool withAvatars) {
  v1::ClientMessage message;
  message.mutable_step()->set_ticks(ticks);
  message.mutable_step()->set_avatars(withAvatars);
  v1::ServerMessage reply = request(std::move(message));
  expectBody(reply, v1::ServerMessage::kStep, "StepReply");
  return std::move(*reply.mutable_step());
}

v1::SetClockReply Client::setClock(const v1::SetClock& clock) {
  v1::ClientMessage message;
  *message.mutable_set_clock() = clock;
  v1::ServerMessage reply = request(std::move(message));
  expectBody(reply, v1::ServerMessage::kSetClock, "SetClockReply");
  return std::move(*reply.mutable_set_clock());
}

v1::SubscribeReply Client::subscribe(const v1::Subscribe& subscription) {
  v1::ClientMessage message;
  *message.mutable_subscribe() = subscription;
  v1::ServerMessage reply = request(std::move(message));
  expectBody(reply, v1::ServerMessage::kSubscribe, "SubscribeReply");
  return std::move(*reply.mutable_subscribe());
}

ReceivedFrame Client::frame(const v1::FrameRequest& frameRequest) {
  v1::ClientMessage message;
  *message.mutable_frame() = frameRequest;
  ReceivedFrame frame;
  v1::ServerMessage reply = request(std::move(message), &frame.pixels);
  expectBody(reply, v1::ServerMessage::kFrame, "Frame");
  frame.description = std::move(*reply.mutable_frame());
  for (const v1::Plane& plane : frame.description.planes()) {
    if (plane.offset() > frame.pixels.size() ||
        plane.length() > frame.pixels.size() - plane.offset()) {
      throw ProtocolError(v1::ERROR_BAD_MESSAGE,
                          "a plane of the frame reaches beyond its attachment of " +
                              std::to_string(frame.pixels.size()) + " bytes",
                          "frame.planes");
    }
  }
  return frame;
}

v1::RayReply Client::rays(const v1::RayQuery& query, ReceivedScan* scan) {
  v1::ClientMessage message;
  *message.mutable_rays() = query;
  std::vector<std::uint8_t> bytes;
  v1::ServerMessage reply = request(std::move(message), &bytes);
  expectBody(reply, v1::ServerMessage::kRays, "RayReply");
  const std::size_t count = std::size_t{reply.rays().columns()} * reply.rays().rows();
  if (bytes.size() != count * 8) {
    throw ProtocolError(v1::ERROR_BAD_MESSAGE,
                        "the scan's attachment has " + std::to_string(bytes.size()) +
                            " bytes, not 8 for each of " + std::to_string(count) + " rays",
                        "rays");
  }
  if (scan) {
    scan->distances.resize(count);
    scan->entities.resize(count);
    if (count > 0) {
      std::memcpy(scan->distances.data(), bytes.data(), 4 * count);
      std::memcpy(scan->entities.data(), bytes.data() + 4 * count, 4 * count);
    }
  }
  return std::move(*reply.mutable_rays());
}

std::vector<v1::Entity> Client::describe(std::span<const std::uint32_t> ids) {
  v1::ClientMessage message;
  message.mutable_describe()->mutable_ids()->Add(ids.begin(), ids.end());
  const v1::ServerMessage reply = request(std::move(message));
  expectBody(reply, v1::ServerMessage::kNames, "EntityNames");
  return {reply.names().entities().begin(), reply.names().entities().end()};
}

v1::Metrics Client::metrics() {
  v1::ClientMessage message;
  message.mutable_metrics();
  v1::ServerMessage reply = request(std::move(message));
  expectBody(reply, v1::ServerMessage::kMetrics, "Metrics");
  return std::move(*reply.mutable_metrics());
}

std::deque<v1::ServerMessage> Client::takeEvents() {
  return std::exchange(state_->events, {});
}

std::optional<v1::ServerMessage> Client::nextEvent(std::chrono::milliseconds patience) {
  if (state_->events.empty()) {
    state_->throwIfBroken();
    auto received = state_->receive(Clock::now() + patience);
    if (!received) return std::nullopt;
    if (received->message.reply_to() != 0) {
      state_->breakOff(state_->peer + " answered a request that is not outstanding");
    }
    state_->keepUnasked(std::move(received->message));
  }
  v1::ServerMessage event = std::move(state_->events.front());
  state_->events.pop_front();
  return event;
}

}  // namespace enfilade::protocol
