// A non-blocking client of one server. Replies and events arrive in handlers. The client has no
// thread: its owner calls advance() when descriptor() is ready, or run(), which waits for that.
// Handlers run inside advance(), run() and, if the connection is lost, request(). A handler may use
// and destroy the client.
//
// Not thread-safe. To reconnect, create a new client.
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
  std::string token;  ///< for servers that require one
  std::string world;  ///< the world to join; empty: the main world
  FramingLimits limits = kClientLimits;
  std::size_t maxPendingRequests = 1024;  ///< limit of requests without a reply
  std::size_t maxUnsentBytes = 4u << 20;  ///< limit of request bytes that the socket did not accept
                                          ///< yet
};

/// Thrown if AsyncOptions allows no more requests. Wait for replies first.
struct TooManyRequests : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The reply to one request. An Error in `message` means that the server refused the request.
struct Reply {
  v1::ServerMessage message;
  std::vector<std::uint8_t> attachment;
  bool lost = false;  ///< the connection ended first; the Error in `message` has the reason
};

/// Handlers of events. Each may be empty.
struct AsyncHandlers {
  std::function<void(const v1::Welcome&)> welcome;  ///< called once, before all other handlers
  std::function<void(const v1::TickEvents&)> events;
  std::function<void(const v1::State&)> state;
  std::function<void(const v1::Frame&, std::vector<std::uint8_t> pixels)> frame;  ///< of a frame
                                                                                  ///< subscription
  std::function<void(const v1::Replay&)> replay;  ///< of a world that plays a recording
  /// The connection ended. This is the last call; pending requests were completed before.
  std::function<void(const v1::Error& reason)> closed;
};

class AsyncClient {
 public:
  /// Starts to connect. Does not throw if no server answers: `closed` is called instead. A host
  /// name is looked up synchronously; a numeric address never blocks.
  AsyncClient(const std::string& host, std::uint16_t port, AsyncHandlers handlers,
              const AsyncOptions& options = {});
  ~AsyncClient();  ///< closes; pending handlers are not called, futures are broken
  AsyncClient(AsyncClient&&) noexcept;
  AsyncClient& operator=(AsyncClient&&) noexcept;

  using OnReply = std::function<void(Reply)>;
  /// Sends a request and fills in its request_id. May be called before the welcome.
  /// Throws TooManyRequests.
  void request(v1::ClientMessage message, OnReply onReply);
  std::future<Reply> request(v1::ClientMessage message);
  std::size_t pendingRequests() const;  ///< number of requests without a reply

  int descriptor() const;    ///< for poll(); -1 after the connection ended
  short pollEvents() const;  ///< the events for poll()
  /// Sends and receives without blocking. Returns false after the connection ended.
  bool advance();
  /// Waits up to `timeout` for the socket and advances. Returns false after the connection ended.
  bool run(std::chrono::milliseconds timeout);

 private:
  struct State;
  std::shared_ptr<State> state_;
};

}  // namespace enfilade::protocol
