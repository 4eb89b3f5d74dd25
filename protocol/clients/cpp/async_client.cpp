#include "protocol/clients/cpp/async_client.hpp"

#include <deque>
#include <utility>

#include "protocol/clients/cpp/connection.hpp"

namespace enfilade::protocol {
namespace {

struct Awaited {
  std::uint64_t id = 0;
  AsyncClient::OnReply onReply;
};

v1::Error errorOf(v1::ErrorCode code, const std::string& text) {
  v1::Error error;
  error.set_code(code);
  error.set_message(text);
  return error;
}

Reply lostReply(const v1::Error& why) {
  Reply reply;
  reply.lost = true;
  *reply.message.mutable_error() = why;
  return reply;
}

}  // namespace

/// Shared with whoever is inside advance(): a function of the user's may destroy the client.
struct AsyncClient::State {
  State(const std::string& host, std::uint16_t port, AsyncHandlers userHandlers,
        const AsyncOptions& userOptions)
      : options(userOptions),
        handlers(std::move(userHandlers)),
        connection(host, port, userOptions.limits) {}

  void take(Received received);
  void takeAnswer(Received received);
  void takeUnasked(Received received);
  void greeted(const v1::ServerMessage& answer);
  void end(v1::Error reason);

  const AsyncOptions options;
  const AsyncHandlers handlers;
  Connection connection;
  std::deque<Awaited> awaited;  ///< replies come in the order of the requests
  std::uint64_t lastId = 0;
  v1::Error lastWords;  ///< of the server: an error of the connection, or its goodbye
  bool over = false;    ///< `closed` was told
  v1::Error why;        ///< when over
  bool gone = false;    ///< the client is destroyed: nobody is told anything
};

void AsyncClient::State::end(v1::Error reason) {
  if (over) return;
  over = true;
  why = std::move(reason);
  connection.breakOff(why.message());
  for (const Awaited& one : std::exchange(awaited, {})) {
    if (!gone) one.onReply(lostReply(why));
  }
  if (!gone && handlers.closed) handlers.closed(why);
}

void AsyncClient::State::greeted(const v1::ServerMessage& answer) {
  if (auto problem = welcomeProblem(answer, connection.peer())) return end(std::move(*problem));
  if (handlers.welcome) handlers.welcome(answer.welcome());
}

void AsyncClient::State::takeAnswer(Received received) {
  if (awaited.empty() || awaited.front().id != received.message.reply_to()) {
    return end(errorOf(v1::ERROR_BAD_MESSAGE, connection.peer() + " answered request " +
                                                  std::to_string(received.message.reply_to()) +
                                                  ", whose turn it is not"));
  }
  const Awaited asked = std::move(awaited.front());
  awaited.pop_front();
  asked.onReply({std::move(received.message), std::move(received.attachment)});
}

void AsyncClient::State::takeUnasked(Received received) {
  const v1::ServerMessage& message = received.message;
  if (message.has_error()) {
    lastWords = message.error();
  } else if (message.has_bye()) {
    if (lastWords.message().empty())
      lastWords = errorOf(message.bye().code(), message.bye().reason());
    lastWords.set_message(connection.peer() + " said goodbye: " + lastWords.message());
    end(lastWords);
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

void AsyncClient::State::take(Received received) {
  if (received.message.reply_to() != 0) return takeAnswer(std::move(received));
  takeUnasked(std::move(received));
}

AsyncClient::AsyncClient(const std::string& host, std::uint16_t port, AsyncHandlers handlers,
                         const AsyncOptions& options)
    : state_(std::make_shared<State>(host, port, std::move(handlers), options)) {
  // It is its turn first, so nothing can stand before the welcome.
  v1::ClientMessage hello = helloOf(options.name, options.token);
  hello.mutable_hello()->set_world(options.world);
  request(std::move(hello), [state = state_.get()](const Reply& reply) {
    if (!reply.lost) state->greeted(reply.message);
  });
}

AsyncClient::~AsyncClient() {
  if (state_) state_->gone = true;
}

AsyncClient::AsyncClient(AsyncClient&&) noexcept = default;

AsyncClient& AsyncClient::operator=(AsyncClient&& other) noexcept {
  if (this == &other) return *this;
  if (state_) state_->gone = true;
  state_ = std::move(other.state_);
  return *this;
}

void AsyncClient::request(v1::ClientMessage message, OnReply onReply) {
  State& state = *state_;
  if (state.over) return onReply(lostReply(state.why));
  if (state.awaited.size() >= state.options.requestsUnderWay ||
      state.connection.unsent() > state.options.unsentBytes) {
    throw TooManyRequests(state.connection.peer() + ": " + std::to_string(state.awaited.size()) +
                          " requests and " + std::to_string(state.connection.unsent()) +
                          " bytes are under way: let replies come first");
  }
  message.set_request_id(++state.lastId);
  state.connection.send(message);
  state.awaited.push_back({state.lastId, std::move(onReply)});
}

std::future<Reply> AsyncClient::request(v1::ClientMessage message) {
  const auto promise = std::make_shared<std::promise<Reply>>();
  request(std::move(message), [promise](Reply reply) { promise->set_value(std::move(reply)); });
  return promise->get_future();
}

std::size_t AsyncClient::underWay() const {
  return state_->awaited.size();
}

int AsyncClient::descriptor() const {
  return state_->connection.descriptor();
}

short AsyncClient::wanted() const {
  return state_->connection.wanted();
}

bool AsyncClient::advance() {
  const std::shared_ptr<State> state = state_;  // outlives what the functions do to us
  while (!state->gone && !state->over) {
    auto received = state->connection.next();
    if (!received) break;
    state->take(std::move(*received));
  }
  if (state->gone) return false;
  if (!state->connection.broken().empty()) {
    state->end(errorOf(v1::ERROR_UNSPECIFIED, state->connection.broken()));
  }
  return !state->over;
}

bool AsyncClient::run(std::chrono::milliseconds patience) {
  state_->connection.await(wanted(), std::chrono::steady_clock::now() + patience);
  return advance();
}

}  // namespace enfilade::protocol
