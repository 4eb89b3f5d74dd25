// The one home of the motion's lengths, limits and policies. Verdicts have no tolerance; motion has
// these.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace enfilade::scene {

/// What is left of a move when something that cannot be walked on stops it.
enum class Sliding : std::uint8_t {
  slide,  ///< goes on along what stopped it
  stop    ///< is not made
};

/// Told to clients in Welcome and part of the configuration's hash.
struct Lengths {
  /// metres. Movers come to rest this far from what they lean on; a contact is d < 2 epsilon
  /// (seed 5.1.1: bodies shrunk by epsilon).
  double epsilon = 0.5e-3;
  /// metres. The highest ledge that an avatar walks up, and the deepest it walks down, in one step.
  double stepHeight = 0.3;
  /// metres. A pair that comes closer than this without contact is told as `near`; 0: never.
  double nearMiss = 0;
  /// 1. An avatar stands on what faces up at least this much (cosine of 50 degrees).
  double walkableNormalY = 0.6427876096865393;
  /// metres per second squared, downwards.
  double gravity = 9.80665;
  /// metres per second. A fall gets no faster; also the fastest speed that a command may ask for.
  double speedLimit = 1000;
  /// newtons. What an avatar pushes a free body with at most.
  double pushForce = 300;
  /// seconds of simulated time.
  double tick = 1.0 / 60.0;
  /// seconds of simulated time without progress after which a walk ends as blocked.
  double patience = 2;
  /// metres. The highest jump that a command may ask for.
  double jumpLimit = 2.5;
  /// radians or metres per second. The fastest that a command may move a joint.
  double jointSpeedLimit = 20;
  Sliding sliding = Sliding::slide;
};

/// metres. Two that are nearer are in contact.
inline double contactLimit(const Lengths& lengths) {
  return 2 * lengths.epsilon;
}

/// Why a world cannot have these lengths, naming the one that is wrong; nullopt when it can.
std::optional<std::string> lengthsProblem(const Lengths& lengths);

}  // namespace enfilade::scene
