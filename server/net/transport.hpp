// A connection as bytes, whatever carries them: TCP, or WebSocket. On the network thread alone.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>

#include "server/messages/outgoing_queue.hpp"

namespace enfilade::server {

class Wire {
 public:
  /// `problem` is "" or tells why the connection is over; the bytes are valid during the call.
  using Heard = std::function<void(const std::string& problem, std::span<const std::uint8_t>)>;
  using Written = std::function<void(const std::string& problem)>;

  virtual ~Wire() = default;
  /// Some bytes, once; one read at a time. The callbacks keep the wire's owner alive.
  virtual void read(Heard done) = 0;
  /// All of it, once; one write at a time.
  virtual void write(Encoded message, Written done) = 0;
  /// Nothing more will be written; the peer may still send. Once, after the last write.
  virtual void endSending(std::function<void()> done) = 0;
  virtual void close() = 0;
  /// The peer sends nothing any more: what it sent may still have to be read.
  virtual bool peerEnded() = 0;
  virtual const std::string& peer() const = 0;  ///< for logs: address and port
  virtual bool beginsWithMagic() const = 0;     ///< in both directions
};

}  // namespace enfilade::server
