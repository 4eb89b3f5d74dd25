// What one server takes from its clients, and how long it waits for them.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>

namespace enfilade::server {

struct ServerLimits {
  std::uint32_t worlds = 64;                 ///< in the server, "main" among them
  std::uint32_t avatars = 1000;              ///< in a world
  std::uint32_t pictureSide = 4096;          ///< pixels; render::refusal() allows no more
  std::uint32_t ticksPerStep = 36'000;       ///< ten minutes at the default tick
  std::uint32_t waypoints = 10'000;          ///< of one walk
  std::uint32_t rays = 10'000;               ///< of one RayQuery
  std::uint32_t scanRays = 1'000'000;        ///< of one RangeScan
  std::uint32_t pairs = 1000;                ///< of one DistanceQuery
  std::uint32_t describedIds = 65'536;       ///< of one DescribeEntities
  std::size_t replyBytes = 8u << 20;         ///< of EntityNames; protocol::kClientTakes is twice it
  std::size_t connections = 256;             ///< at one time
  std::uint32_t requestsUnderWay = 1024;     ///< of one client, before it is not read
  std::size_t waitingBytes = 4u << 20;       ///< of those
  std::uint32_t requestsPerSecond = 50'000;  ///< of one client, read over a while
  std::size_t outgoingBytes = 64u << 20;     ///< of unsent replies and events of one client
  std::size_t outgoingFrames = 4;            ///< unsent pictures of one client
  std::size_t outgoingFrameBytes = 512u << 20;  ///< of those, when there are several
  std::uint32_t watches = 16;                   ///< subscriptions to pictures of one client
  int sendBuffer = 0;                           ///< bytes in the system's hands; 0: as it likes
  std::chrono::milliseconds greeting{5'000};    ///< from the connection to the whole Hello
  /// From the making of a world that is dropped when it is empty to its first client.
  std::chrono::milliseconds entry{60'000};
  std::chrono::milliseconds message{10'000};  ///< from a message's first byte to its last
  std::chrono::milliseconds farewell{2'000};  ///< for the last words to be taken
};

}  // namespace enfilade::server
