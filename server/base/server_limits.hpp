// Limits and timeouts that one server applies to its clients.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>

namespace enfilade::server {

struct ServerLimits {
  std::uint32_t worlds = 256;                   ///< per server, "main" included
  std::uint32_t avatars = 1000;                 ///< per world
  std::uint32_t imageSide = 4096;               ///< pixels; also the limit of the renderer
  std::uint32_t ticksPerStep = 36'000;          ///< ten minutes at the default tick
  std::uint32_t waypoints = 10'000;             ///< per walk
  std::uint32_t rays = 10'000;                  ///< per RayQuery
  std::uint32_t scanRays = 1'000'000;           ///< per RangeScan
  std::uint32_t pairs = 1000;                   ///< per DistanceQuery
  std::uint32_t describedIds = 65'536;          ///< per DescribeEntities
  std::size_t uploadBytes = 64u << 20;          ///< of all parts of a client
  std::size_t replyBytes = 8u << 20;            ///< of EntityNames; half of protocol::kClientLimits
  std::size_t connections = 256;                ///< open at the same time
  std::size_t reservedConnections = 32;         ///< more, for health checks and refusals
  std::size_t streams = 64;                     ///< MJPEG streams at the same time
  std::uint32_t pendingRequests = 1024;         ///< per client; above, its socket is not read
  std::size_t pendingRequestBytes = 4u << 20;   ///< of these requests
  std::uint32_t requestsPerSecond = 50'000;     ///< per client, averaged
  std::size_t outgoingBytes = 64u << 20;        ///< of unsent replies and events per client
  std::size_t totalOutgoingBytes = 1u << 30;    ///< of all clients
  std::size_t outgoingFrames = 64;              ///< unsent frames per client
  std::size_t outgoingFrameBytes = 512u << 20;  ///< of several unsent frames
  std::uint32_t frameSubscriptions = 16;        ///< frame subscriptions per client
  int sendBuffer = 0;                           ///< bytes of the socket; 0: system default
  std::chrono::milliseconds helloTimeout{5'000};  ///< from connect to complete Hello
  /// From the creation of a world with drop_when_empty to its first client.
  std::chrono::milliseconds emptyWorldTimeout{60'000};
  std::chrono::milliseconds messageTimeout{10'000};  ///< from a message's first byte to its last
  std::chrono::milliseconds closeTimeout{2'000};     ///< for the peer to read the final message
  std::chrono::milliseconds streamTimeout{60'000};   ///< for a stream's first picture
  /// A browser shows a picture of a stream when the next part begins: without a newer picture the
  /// last one is sent again.
  std::chrono::milliseconds repeatDelay{300};
};

}  // namespace enfilade::server
