// Interface of a byte connection: TCP or WebSocket. Network thread only.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>

#include "server/messages/outgoing_queue.hpp"

namespace enfilade::server {

class Transport {
 public:
  /// `problem`: "" or the reason why the connection ended. The bytes are valid during the call.
  using ReadHandler =
      std::function<void(const std::string& problem, std::span<const std::uint8_t>)>;
  using WriteHandler = std::function<void(const std::string& problem)>;

  virtual ~Transport() = default;
  /// Reads some bytes and calls `done` once; one read at a time. Callbacks keep the owner alive.
  virtual void read(ReadHandler done) = 0;
  /// Writes the whole message and calls `done` once; one write at a time.
  virtual void write(EncodedMessage message, WriteHandler done) = 0;
  /// Shuts down the sending side; the peer may still send. Call it once, after the last write.
  virtual void shutdownSend(std::function<void()> done) = 0;
  virtual void close() = 0;
  /// Whether the peer has stopped sending; unread bytes may remain.
  virtual bool peerClosed() = 0;
  virtual const std::string& peer() const = 0;  ///< for logs: address and port
  virtual bool usesMagic() const = 0;           ///< both directions start with magic bytes
};

}  // namespace enfilade::server
