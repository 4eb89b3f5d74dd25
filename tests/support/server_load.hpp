// Load on a server: many clients with one connection each, on one thread, which check their events
// for gaps, repeats and ends without a beginning. Also short visits, some of which break off.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "collision/types.hpp"
#include "scene/world/data/scene.hpp"

namespace enfilade::tests {

/// Finds `count` places with ground where avatars can stand next to one another; fewer if there are
/// not enough.
std::vector<collision::Vec3> findStandingPlaces(std::shared_ptr<const scene::Scene> scene,
                                                int count, unsigned seed);

struct LoadOptions {
  std::uint16_t port = 0;
  std::vector<collision::Vec3> places;  ///< one client at each
  double seconds = 2;                   ///< of running the clock freely
  double commandRate = 60;              ///< Drive commands a second of each client
  double stateRate = 0;                 ///< State messages a second of simulated time; 0: each tick
  std::size_t watchEvery = 1;           ///< one of so many clients receives states
};

struct LoadResult {
  std::vector<std::string> faults;  ///< violations; at most a few per client
  std::uint64_t clients = 0, welcomed = 0, spawned = 0, closedInPeace = 0;
  std::uint64_t commands = 0, replies = 0, refused = 0;
  std::uint64_t unsent = 0;  ///< commands that these clients were too slow to send on time
  std::uint64_t tickEvents = 0, begins = 0, ends = 0, states = 0, droppedStates = 0;
  std::uint64_t ticks = 0;  ///< from the first State to the last, of the client that received most
  double wallSeconds = 0;   ///< of those ticks
  /// Latency in ticks from a command to the first State that shows it, sorted. First: from the
  /// server's tick when it accepted the command. Second: from the last tick known to the client
  /// when it sent the command.
  std::vector<std::uint64_t> acceptedToShown, sentToShown;  ///< of clients that receive states
};

/// Clients connect, spawn and drive to and fro while the clock runs freely. They stay connected
/// until `stop` has stopped the server, so that all contacts end.
LoadResult runLoad(const LoadOptions& options, const std::function<void()>& beforeStop,
                   const std::function<void()>& stop);

/// Makes `count` visits. Some say hello and goodbye, some leave in the middle of a message. Some
/// close one direction only, some close at once, some spawn an avatar and vanish.
void visitRudely(std::uint16_t port, int count, unsigned seed);

/// Resource use of this process.
struct Footprint {
  std::uint64_t residentBytes = 0;
  std::uint64_t descriptors = 0, threads = 0;
};
Footprint measureFootprint();

}  // namespace enfilade::tests
