// A client of one server that never waits: replies and what comes unasked arrive in functions of
// the user's. It has no thread: its owner calls advance() whenever descriptor() is ready, or run(),
// which waits for that. All functions are called inside advance(), run() and, where the connection
// is lost, request(); from any of them the client may be used, and destroyed.
//
// Not for use from two threads at once. Reconnecting is the user's: make a new one.
#pragma once

#include <chrono>
#include <functional>
#include <future>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "protocol/enfilade.pb.h"
#include "protocol/framing.hpp"

namespace enfilade::protocol {

struct AsyncOptions {
  std::string name = "enfilade client";
  std::string token;  ///< for servers that want one
  std::string world;  ///< that it enters; empty: the main one
  FramingLimits limits = kClientTakes;
  std::size_t requestsUnderWay = 1024;  ///< without a reply
  std::size_t unsentBytes = 4u << 20;   ///< of requests that the socket does not take yet
};

/// More requests than AsyncOptions allows: let replies come first.
struct TooManyRequests : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The answer to one request. Where `message` has an Error, the server refused it.
struct Reply {
  v1::ServerMessage message;
  std::vector<std::uint8_t> attachment;
  bool lost = false;  ///< no answer: the connection ended, as the Error in `message` says
};

/// What comes unasked; any may be empty.
struct AsyncHandlers {
  std::function<void(const v1::Welcome&)> welcome;  ///< once, before all else
  std::function<void(const v1::TickEvents&)> events;
  std::function<void(const v1::State&)> state;
  std::function<void(const v1::Frame&, std::vector<std::uint8_t> pixels)> frame;  ///< of a watch
  std::function<void(const v1::Replay&)> replay;  ///< of a world that plays a recording
  /// The last call: the connection is over. Requests without an answer were told before.
  std::function<void(const v1::Error& why)> closed;
};

class AsyncClient {
 public:
  /// Begins to connect and greet. Does not throw where nobody answers: `closed` is told. A name is
  /// looked up at once; an address in numbers never waits.
  AsyncClient(const std::string& host, std::uint16_t port, AsyncHandlers handlers,
              const AsyncOptions& options = {});
  ~AsyncClient();  ///< closes; whoever waits for a reply is not told, futures are broken
  AsyncClient(AsyncClient&&) noexcept;
  AsyncClient& operator=(AsyncClient&&) noexcept;

  using OnReply = std::function<void(Reply)>;
  /// May be called before the welcome: it goes out behind the hello. request_id is filled in.
  /// Throws TooManyRequests.
  void request(v1::ClientMessage message, OnReply onReply);
  std::future<Reply> request(v1::ClientMessage message);
  std::size_t underWay() const;  ///< requests without a reply

  int descriptor() const;  ///< for poll(); -1 when the connection is over
  short wanted() const;    ///< the events to poll for
  /// Does all that can be done without waiting. False when the connection is over.
  bool advance();
  /// Waits for the socket, up to `patience`, and advances. False when the connection is over.
  bool run(std::chrono::milliseconds patience);

 private:
  struct State;
  std::shared_ptr<State> state_;
};

}  // namespace enfilade::protocol
