// Settings of a world's motion: offsets, limits, time step and policies. Collision verdicts have no
// tolerance; only motion uses these values.
#pragma once

#include <cstdint>

namespace enfilade::scene {

/// Policy for the remaining displacement after a non-walkable obstacle stops a move.
enum class Sliding : std::uint8_t {
  slide,  ///< slides along the obstacle
  stop    ///< is discarded
};

/// Sent to clients in Welcome, and part of the configuration's hash.
struct WorldSettings {
  /// metres. Gap that avatars and bodies keep from obstacles. A contact is a distance below twice
  /// this value, as if shapes were shrunk by it (Lin 1993, section 5.1.1).
  double contactOffset = 0.5e-3;
  /// metres. Maximum height that an avatar steps up or down at once.
  double stepHeight = 0.3;
  /// metres. A pair that comes closer than this without contact is reported as `near`; 0: never.
  double nearMissDistance = 0;
  /// Minimum y component of a walkable surface's unit normal (cosine of 50 degrees).
  double walkableNormalY = 0.6427876096865393;
  /// metres per second squared, downwards.
  double gravity = 9.80665;
  /// metres per second. Maximum speed of a fall, and maximum speed that a command may request.
  double maxSpeed = 1000;
  /// newtons. Maximum force with which an avatar pushes a rigid body.
  double maxPushForce = 300;
  /// seconds of simulated time per tick.
  double tickDuration = 1.0 / 60.0;
  /// seconds of simulated time without progress after which a walk ends as blocked.
  double stuckTimeout = 2;
  /// metres. Maximum jump height that a command may request.
  double maxJumpHeight = 2.5;
  /// radians or metres per second. Maximum joint speed that a command may request.
  double maxJointSpeed = 20;
  Sliding sliding = Sliding::slide;

  bool operator==(const WorldSettings&) const = default;
};

/// Distance below which a pair is in contact, metres.
inline double computeContactThreshold(const WorldSettings& settings) {
  return 2 * settings.contactOffset;
}

/// Distance within which contacts and near misses are searched, metres.
inline double computeContactQueryMargin(const WorldSettings& settings) {
  return 2 * settings.contactOffset + settings.nearMissDistance;
}

}  // namespace enfilade::scene
