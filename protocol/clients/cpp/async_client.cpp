#include "protocol/clients/cpp/async_client.hpp"

#include <deque>
#include <utility>

#include "protocol/clients/cpp/connection.hpp"

namespace enfilade::protocol {
namespace {

struct PendingRequest {
  std::uint64_t id = 0;
  AsyncClient::OnReply onReply;
};

Reply makeLostReply(const v1::Error& error) {
  Reply reply;
  reply.lost = true;
  *reply.message.mutable_error() = error;
  return reply;
}

}  // namespace

/// The client's state. advance() shares its ownership, because a handler may destroy the client.
struct AsyncClient::State {
  State(const std::string& host, std::uint16_t port, AsyncHandlers userHandlers,
        const AsyncOptions& userOptions)
      : options(userOptions),
        handlers(std::move(userHandlers)),
        connection(host, port, userOptions.limits) {}

  void handleMessage(Received received);
  void handleReply(Received received);
  void handleEvent(Received received);
  void handleWelcome(const v1::ServerMessage& reply);
  void finish(v1::Error reason);

  const AsyncOptions options;
  const AsyncHandlers handlers;
  Connection connection;
  std::deque<PendingRequest> pending;  ///< replies arrive in the order of the requests
  std::uint64_t lastId = 0;
  v1::Error finalMessage;        ///< last Error or Bye of the server
  bool isClosed = false;         ///< AsyncHandlers::closed was called
  v1::Error closeReason;         ///< valid if isClosed
  bool clientDestroyed = false;  ///< no handler may be called any more
};

void AsyncClient::State::finish(v1::Error reason) {
  if (isClosed) return;
  isClosed = true;
  closeReason = std::move(reason);
  connection.disconnect(closeReason.message());
  for (const PendingRequest& one : std::exchange(pending, {})) {
    if (!clientDestroyed) one.onReply(makeLostReply(closeReason));
  }
  if (!clientDestroyed && handlers.closed) handlers.closed(closeReason);
}

void AsyncClient::State::handleWelcome(const v1::ServerMessage& reply) {
  if (auto problem = validateWelcome(reply, connection.peer())) return finish(std::move(*problem));
  if (handlers.welcome) handlers.welcome(reply.welcome());
}

void AsyncClient::State::handleReply(Received received) {
  if (pending.empty() || pending.front().id != received.message.reply_to()) {
    return finish(
        makeError(v1::ERROR_BAD_MESSAGE, connection.peer() + " answered request " +
                                             std::to_string(received.message.reply_to()) +
                                             ", which is not the oldest pending request"));
  }
  const PendingRequest pendingRequest = std::move(pending.front());
  pending.pop_front();
  pendingRequest.onReply({std::move(received.message), std::move(received.attachment)});
}

void AsyncClient::State::handleEvent(Received received) {
  const v1::ServerMessage& message = received.message;
  if (message.has_error()) {
    finalMessage = message.error();
  } else if (message.has_bye()) {
    if (finalMessage.message().empty())
      finalMessage = makeError(message.bye().code(), message.bye().reason());
    finalMessage.set_message(connection.peer() + " closed the session: " + finalMessage.message());
    finish(finalMessage);
  } else if (message.has_events() && handlers.events) {
    handlers.events(message.events());
  } else if (message.has_state() && handlers.state) {
    handlers.state(message.state());
  } else if (message.has_replay() && handlers.replay) {
    handlers.replay(message.replay());
  } else if (message.has_frame() && handlers.frame) {
    handlers.frame(message.frame(), std::move(received.attachment));
  }
}

void AsyncClient::State::handleMessage(Received received) {
  if (received.message.reply_to() != 0) return handleReply(std::move(received));
  handleEvent(std::move(received));
}

AsyncClient::AsyncClient(const std::string& host, std::uint16_t port, AsyncHandlers handlers,
                         const AsyncOptions& options)
    : state_(std::make_shared<State>(host, port, std::move(handlers), options)) {
  // The hello is the first message, so that the welcome is the first reply.
  v1::ClientMessage hello = makeHello(options.name, options.token);
  hello.mutable_hello()->set_world(options.world);
  request(std::move(hello), [state = state_.get()](const Reply& reply) {
    if (!reply.lost) state->handleWelcome(reply.message);
  });
}

AsyncClient::~AsyncClient() {
  if (state_) state_->clientDestroyed = true;
}

AsyncClient::AsyncClient(AsyncClient&&) noexcept = default;

AsyncClient& AsyncClient::operator=(AsyncClient&& other) noexcept {
  if (this == &other) return *this;
  if (state_) state_->clientDestroyed = true;
  state_ = std::move(other.state_);
  return *this;
}

void AsyncClient::request(v1::ClientMessage message, OnReply onReply) {
  State& state = *state_;
  if (state.isClosed) return onReply(makeLostReply(state.closeReason));
  if (state.pending.size() >= state.options.maxPendingRequests ||
      state.connection.unsent() > state.options.maxUnsentBytes) {
    throw TooManyRequests(state.connection.peer() + ": " + std::to_string(state.pending.size()) +
                          " requests and " + std::to_string(state.connection.unsent()) +
                          " bytes are pending: wait for replies first");
  }
  message.set_request_id(++state.lastId);
  state.connection.send(message);
  state.pending.push_back({state.lastId, std::move(onReply)});
}

std::future<Reply> AsyncClient::request(v1::ClientMessage message) {
  const auto promise = std::make_shared<std::promise<Reply>>();
  request(std::move(message), [promise](Reply reply) { promise->set_value(std::move(reply)); });
  return promise->get_future();
}

std::size_t AsyncClient::pendingRequests() const {
  return state_->pending.size();
}

int AsyncClient::descriptor() const {
  return state_->connection.descriptor();
}

short AsyncClient::pollEvents() const {
  return state_->connection.pollEvents();
}

bool AsyncClient::advance() {
  const std::shared_ptr<State> state = state_;  // keeps the state alive for handlers
  while (!state->clientDestroyed && !state->isClosed) {
    auto received = state->connection.next();
    if (!received) break;
    state->handleMessage(std::move(*received));
  }
  if (state->clientDestroyed) return false;
  if (!state->connection.disconnectReason().empty()) {
    state->finish(makeError(v1::ERROR_UNSPECIFIED, state->connection.disconnectReason()));
  }
  return !state->isClosed;
}

bool AsyncClient::run(std::chrono::milliseconds timeout) {
  state_->connection.waitFor(pollEvents(), std::chrono::steady_clock::now() + timeout);
  return advance();
}

}  // namespace enfilade::protocol
