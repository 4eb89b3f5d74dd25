// A pair of convex parts of two bodies: the state that the narrow phase keeps between steps, and
// the contact constraint for the solver.
#pragma once

#include <cmath>
#include <compare>
#include <memory>

#include "collision/narrow_phase/penetration_depth.hpp"
#include "scene/physics/contact_constraint.hpp"
#include "scene/physics/physics_body.hpp"

namespace enfilade::scene {

/// Indices of two bodies and of their parts; a < b.
struct PartPairKey {
  std::uint32_t a = 0, b = 0, partA = 0, partB = 0;
  auto operator<=>(const PartPairKey&) const = default;
};

using ContactAnchors = std::array<Vec3, ContactConstraint::kMaxPoints>;

/// Narrow-phase state of a pair. It exists only for pairs that came close enough for a query.
struct PairCache {
  collision::FeatureCache features;
  std::unique_ptr<collision::DepthCache> depth;  ///< set after the first penetration
  /// metres: the penetration depth or an upper bound; set while penetrating
  double penetration = 0;
  ContactConstraint constraint;  ///< valid if BodyPair::hasConstraint; a and b are not set
  ContactAnchors anchors;        ///< contact points in the frame of the anchor body
  enum class NormalSource : std::uint8_t {
    closestPoints,
    faceA,
    faceB
  } normalSource = NormalSource::closestPoints;
};

/// State of a pair of parts. It is small, because most pairs are far apart in every step.
struct BodyPair {
  PartPairKey key;
  /// Metres: certified lower bound of the distance when the bodies' teleportedDistance summed to
  /// `teleportedAtBound`. Later teleports reduce it; see computeLowerBound().
  double lowerBound = -1;
  double teleportedAtBound = 0;
  Vec3 separatingAxis =
      Vec3::Zero();  ///< world, from A to B, unit: the last separating axis; zero: none yet
  collision::Verdict verdict = collision::Verdict::separated;  ///< of the last query
  std::unique_ptr<PairCache> cache;                            ///< null: never queried

  bool hasConstraint = false;
  bool touched = false;   ///< the bodies touched when the pair was last updated
  bool reported = false;  ///< the pair was close when contacts were last reported
  /// the pair had a contact impulse in the last step, even if it is separated now
  bool gaveImpulse = false;

  /// Null: the pair has no contact constraint.
  ContactConstraint* constraint() { return hasConstraint ? &cache->constraint : nullptr; }
  const ContactConstraint* constraint() const {
    return hasConstraint ? &cache->constraint : nullptr;
  }
  double penetration() const {
    return verdict == collision::Verdict::penetrating ? cache->penetration : 0;
  }
  collision::FeatureCache features() const {
    return cache ? cache->features : collision::FeatureCache{};
  }
};

struct PairStepSettings {
  double seconds = 0;
  Vec3 gravity = Vec3::Zero();
  double contactOffset = 0;
};

/// Updates verdict, distance and constraint for the present poses. Skips the query if the
/// velocities cannot bring the pair within contactOffset in this step. Returns whether a query ran.
bool updatePair(BodyPair& pair, const PhysicsBody& a, const PhysicsBody& b,
                const PairStepSettings& step);

/// Certified lower bound of the present distance, in metres; may be negative. `teleported`: sum of
/// teleportedDistance of both bodies.
inline double computeLowerBound(const BodyPair& pair, double teleported) {
  const double rounding =
      0x1p-51 * (teleported + pair.teleportedAtBound + std::abs(pair.lowerBound));
  return pair.lowerBound - (teleported - pair.teleportedAtBound) - rounding;
}
inline double computeLowerBound(const BodyPair& pair, const PhysicsBody& a, const PhysicsBody& b) {
  return computeLowerBound(pair, a.teleportedDistance + b.teleportedDistance);
}

/// Compact copy of the body data that the far test needs. Most pairs need only this, so it lies
/// contiguous in memory.
struct SpeedBound {
  double speed = 0;  ///< m/s: bound of the speed of any point relative to the reference velocity
  double teleportedDistance = 0;                                ///< copy of PhysicsBody's
  bool isDynamic = false, isAwake = false, isActuated = false;  ///< copies of PhysicsBody's
};
SpeedBound computeSpeedBound(const PhysicsBody& body, const Vec3& referenceVelocity);

/// Returns whether the speed bounds prove that updatePair() would skip its query.
bool isCertifiedFar(const BodyPair& pair, const SpeedBound& a, const SpeedBound& b,
                    const PairStepSettings& step);

/// Returns whether a dynamic body penetrates a kinematic one, which pressed it against an obstacle.
bool penetratesKinematic(const BodyPair& pair, const PhysicsBody& a, const PhysicsBody& b);

/// Returns whether the shortest way out does not lie ahead of the kinematic body. The kinematic
/// body then passes through without friction and does not carry the other one.
bool isReleased(const BodyPair& pair, const PhysicsBody& a, const PhysicsBody& b);

/// Returns whether a contact point is closer than 2 contactOffset.
bool isTouching(const BodyPair& pair, double contactOffset);

}  // namespace enfilade::scene
