#include "protocol/clients/cpp/client.hpp"

#include <poll.h>

#include <cstring>
#include <utility>

#include "protocol/clients/cpp/connection.hpp"

namespace enfilade::protocol {
namespace {

using Clock = std::chrono::steady_clock;

std::string formatSeconds(std::chrono::milliseconds time) {
  const auto count = time.count();
  return count % 1000 == 0 ? std::to_string(count / 1000) + " s" : std::to_string(count) + " ms";
}

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

/// A Connection with blocking operations.
struct Client::State {
  State(const std::string& host, std::uint16_t port, const ClientOptions& clientOptions)
      : options(clientOptions), connection(host, port, clientOptions.limits) {}

  void connect(Clock::time_point deadline);
  void greet(Clock::time_point deadline);
  void send(const v1::ClientMessage& message, Clock::time_point deadline);
  std::optional<Received> receive(Clock::time_point deadline);
  void queueEvent(v1::ServerMessage message);
  [[noreturn]] void disconnect(const std::string& reason);
  void throwIfBroken() const;
  bool isClosed() const { return !endReason.empty() || !connection.disconnectReason().empty(); }

  ClientOptions options;
  Connection connection;
  std::deque<v1::ServerMessage> events;
  v1::Welcome welcome;
  std::uint64_t lastId = 0;
  std::string endReason;  ///< not empty: the server's reason for ending the connection
};

void Client::State::disconnect(const std::string& reason) {
  connection.disconnect(reason);
  throw ConnectionError(connection.disconnectReason());
}

void Client::State::throwIfBroken() const {
  if (!endReason.empty()) throw ConnectionError(endReason);
  if (!connection.disconnectReason().empty()) throw ConnectionError(connection.disconnectReason());
}

void Client::State::connect(Clock::time_point deadline) {
  while (connection.disconnectReason().empty() && !connection.connected()) {
    if (!connection.waitFor(POLLOUT, deadline)) {
      disconnect("cannot connect to " + connection.peer() + ": no answer within " +
                 formatSeconds(options.timeout) +
                 "; is `enfilade serve` running there, and does the port match its ready line?");
    }
    connection.advance();
  }
  throwIfBroken();
}

/// Returns after all bytes were sent. Incoming messages stay in the socket.
void Client::State::send(const v1::ClientMessage& message, Clock::time_point deadline) {
  connection.send(message);
  while (connection.unsent() > 0 && connection.disconnectReason().empty()) {
    if (connection.writeFailed()) {
      // The server's last message explains more than the broken pipe.
      while (auto received = receive(Clock::now())) {
        if (received->message.reply_to() == 0) queueEvent(std::move(received->message));
        throwIfBroken();
      }
      disconnect(connection.peer() + " closed the connection");
    }
    if (!connection.waitFor(POLLOUT, deadline)) {
      disconnect(connection.peer() + " accepted no data for " + formatSeconds(options.timeout) +
                 "; is the server stopped or overloaded?");
    }
    connection.advance();
  }
  throwIfBroken();
}

/// Returns the next message; nullopt after the deadline (a partial message is kept).
std::optional<Received> Client::State::receive(Clock::time_point deadline) {
  for (;;) {
    if (auto received = connection.next()) return received;
    throwIfBroken();
    if (!connection.waitFor(POLLIN, deadline)) return std::nullopt;
  }
}

/// Queues an event. A Bye is the last event and breaks the connection. Throws connection errors.
void Client::State::queueEvent(v1::ServerMessage message) {
  if (message.has_error()) {
    const v1::Error& error = message.error();
    endReason = connection.peer() + " ended the connection: " + error.message();
    throw ProtocolError(error.code(), endReason, error.field());
  }
  if (message.has_bye()) {
    const std::string& reason = message.bye().reason();
    endReason =
        connection.peer() + " closed the session: " + (reason.empty() ? "no reason given" : reason);
  }
  events.push_back(std::move(message));
}

void Client::State::greet(Clock::time_point deadline) {
  v1::ClientMessage hello = makeHello(options.name, options.token);
  hello.set_request_id(++lastId);
  hello.mutable_hello()->set_world(options.world);
  send(hello, deadline);
  auto received = receive(deadline);
  if (!received) {
    disconnect(connection.peer() + " did not answer the greeting within " +
               formatSeconds(options.timeout) + "; is that an Enfilade server?");
  }
  if (received->message.has_bye()) {
    disconnect(connection.peer() + " refused the connection: " + received->message.bye().reason());
  }
  if (const auto problem = validateWelcome(received->message, connection.peer())) {
    throw ProtocolError(problem->code(), problem->message(), problem->field());
  }
  welcome = std::move(*received->message.mutable_welcome());
}

// ---- the client --------------------------------------------------------------------------------

Client::Client(const std::string& host, std::uint16_t port, const ClientOptions& options)
    : state_(std::make_unique<State>(host, port, options)) {
  const auto deadline = Clock::now() + options.timeout;
  state_->connect(deadline);
  state_->greet(deadline);
}

Client::~Client() {
  if (!state_ || state_->isClosed()) return;
  v1::ClientMessage bye;
  bye.set_request_id(++state_->lastId);
  bye.mutable_bye();
  try {
    state_->send(bye, Clock::now() + std::chrono::milliseconds(100));
  } catch (const std::exception&) {
    // The connection ends in any case.
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
      state_->disconnect(state_->connection.peer() + " did not answer within " +
                         formatSeconds(state_->options.timeout) +
                         "; is it overloaded? A longer timeout may help");
    }
    if (received->message.reply_to() == 0) {
      state_->queueEvent(std::move(received->message));
      state_->throwIfBroken();
      continue;
    }
    if (received->message.reply_to() != id) {
      state_->disconnect(state_->connection.peer() + " answered request " +
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

/// Throws if the reply has another type than requested.
void expectBody(const v1::ServerMessage& reply, v1::ServerMessage::BodyCase wanted,
                const std::string& name) {
  if (reply.body_case() != wanted) {
    throw ProtocolError(v1::ERROR_BAD_MESSAGE,
                        "the server's reply is not a " + name + "; do the versions match?");
  }
}

/// Sends a request and returns the body of its reply.
template <class Reply>
Reply requestBody(Client& client, v1::ClientMessage message, v1::ServerMessage::BodyCase wanted,
                  Reply* (v1::ServerMessage::*mutableBody)()) {
  v1::ServerMessage reply = client.request(std::move(message));
  expectBody(reply, wanted, Reply::descriptor()->name());
  return std::move(*(reply.*mutableBody)());
}

}  // namespace

std::optional<v1::Error> Client::command(const v1::Command& command) {
  v1::ClientMessage message;
  *message.mutable_command() = command;
  return sendCommand(std::move(message));
}

std::optional<v1::Error> Client::bodyCommand(const v1::BodyCommand& command) {
  v1::ClientMessage message;
  *message.mutable_body_command() = command;
  return sendCommand(std::move(message));
}

std::optional<v1::Error> Client::sendCommand(v1::ClientMessage message) {
  v1::ServerMessage reply;
  try {
    reply = request(std::move(message));
  } catch (const ProtocolError& problem) {
    if (state_->isClosed()) throw;
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
  return requestBody(*this, std::move(message), v1::ServerMessage::kStep,
                     &v1::ServerMessage::mutable_step);
}

v1::SetClockReply Client::setClock(const v1::SetClock& clock) {
  v1::ClientMessage message;
  *message.mutable_set_clock() = clock;
  return requestBody(*this, std::move(message), v1::ServerMessage::kSetClock,
                     &v1::ServerMessage::mutable_set_clock);
}

v1::SeekReply Client::seek(std::uint64_t tick) {
  v1::ClientMessage message;
  message.mutable_seek()->set_tick(tick);
  return requestBody(*this, std::move(message), v1::ServerMessage::kSeek,
                     &v1::ServerMessage::mutable_seek);
}

v1::TakeOverReply Client::takeOver(const std::string& avatar) {
  v1::ClientMessage message;
  message.mutable_take_over()->set_avatar(avatar);
  return requestBody(*this, std::move(message), v1::ServerMessage::kTakeOver,
                     &v1::ServerMessage::mutable_take_over);
}

v1::SubscribeReply Client::subscribe(const v1::Subscribe& subscription) {
  v1::ClientMessage message;
  *message.mutable_subscribe() = subscription;
  return requestBody(*this, std::move(message), v1::ServerMessage::kSubscribe,
                     &v1::ServerMessage::mutable_subscribe);
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
                          "a plane of the frame exceeds its attachment of " +
                              std::to_string(frame.pixels.size()) + " bytes",
                          "frame.planes");
    }
  }
  return frame;
}

v1::RayReply Client::rays(const v1::RayQuery& query, ReceivedScan* scan) {
  v1::ClientMessage message;
  *message.mutable_rays() = query;
  message.mutable_rays()->clear_packed();  // the caller gets hits
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

v1::DistanceReply Client::distances(const v1::DistanceQuery& query) {
  v1::ClientMessage message;
  *message.mutable_distances() = query;
  return requestBody(*this, std::move(message), v1::ServerMessage::kDistances,
                     &v1::ServerMessage::mutable_distances);
}

v1::TouchingReply Client::touching(const v1::TouchingQuery& query) {
  v1::ClientMessage message;
  *message.mutable_touching() = query;
  return requestBody(*this, std::move(message), v1::ServerMessage::kTouching,
                     &v1::ServerMessage::mutable_touching);
}

v1::CannotTouchReply Client::cannotTouch(const v1::CannotTouchQuery& query) {
  v1::ClientMessage message;
  *message.mutable_cannot_touch() = query;
  return requestBody(*this, std::move(message), v1::ServerMessage::kCannotTouch,
                     &v1::ServerMessage::mutable_cannot_touch);
}

v1::FloorPlan Client::floorPlan(double floor) {
  v1::ClientMessage message;
  message.mutable_floor_plan()->set_floor(floor);
  return requestBody(*this, std::move(message), v1::ServerMessage::kFloorPlan,
                     &v1::ServerMessage::mutable_floor_plan);
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
  return requestBody(*this, std::move(message), v1::ServerMessage::kMetrics,
                     &v1::ServerMessage::mutable_metrics);
}

std::deque<v1::ServerMessage> Client::takeEvents() {
  return std::exchange(state_->events, {});
}

std::optional<v1::ServerMessage> Client::nextEvent(std::chrono::milliseconds timeout) {
  if (state_->events.empty()) {
    state_->throwIfBroken();
    auto received = state_->receive(Clock::now() + timeout);
    if (!received) return std::nullopt;
    if (received->message.reply_to() != 0) {
      state_->disconnect(state_->connection.peer() + " answered a request that is not pending");
    }
    state_->queueEvent(std::move(received->message));
  }
  v1::ServerMessage event = std::move(state_->events.front());
  state_->events.pop_front();
  return event;
}

}  // namespace enfilade::protocol
