// Many clients of one server, each with a connection of its own, on one thread: what they hear is
// checked for gaps, repeats and ends without a beginning. And visitors who come and go, rudely too.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "collision/types.hpp"
#include "scene/world/data/scene.hpp"

namespace enfilade::tests {

/// `count` places with ground where avatars can stand beside one another; fewer when there are
/// none.
std::vector<collision::Vec3> standingPlaces(std::shared_ptr<const scene::Scene> scene, int count,
                                            unsigned seed);

struct LoadOptions {
  std::uint16_t port = 0;
  std::vector<collision::Vec3> places;  ///< one client each
  double seconds = 2;                   ///< of free-running time
  double commandRate = 60;              ///< Drive commands a second of each client
  double stateRate = 0;                 ///< State messages a second of simulated time; 0: each tick
  std::size_t watchEvery = 1;           ///< every so many clients one hears states
};

struct LoadResult {
  std::vector<std::string> faults;  ///< what must not be; at most a few of each client
  std::uint64_t clients = 0, welcomed = 0, spawned = 0, closedInPeace = 0;
  std::uint64_t commands = 0, replies = 0, refused = 0;
  std::uint64_t unsent = 0;  ///< commands that these clients were too slow to send in time
  std::uint64_t tickEvents = 0, begins = 0, ends = 0, states = 0, droppedStates = 0;
  std::uint64_t ticks = 0;  ///< from the first State to the last, of the client that saw most
  double wallSeconds = 0;   ///< over those ticks
  /// Ticks from a command to the first State that shows it: from the last tick made when the server
  /// took it, and from the last one that the client had heard of when it sent it. Sorted.
  std::vector<std::uint64_t> acceptedToShown, sentToShown;  ///< of clients that hear states
};

/// The clients come, spawn, drive to and fro while the clock runs freely, and stay until `stop` has
/// stopped the server, so that all contacts end.
LoadResult runLoad(const LoadOptions& options, const std::function<void()>& beforeStop,
                   const std::function<void()>& stop);

/// `count` visits: some say hello and goodbye, some leave in the middle of a message, some close
/// one direction only, some close at once, some have an avatar and vanish.
void visitRudely(std::uint16_t port, int count, unsigned seed);

/// Of this process.
struct Footprint {
  std::uint64_t residentBytes = 0;
  std::uint64_t descriptors = 0, threads = 0;
};
Footprint footprint();

}  // namespace enfilade::tests
