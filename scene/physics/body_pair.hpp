// Two parts of two solids that may meet: what is known of them from step to step, and the patch
// that the solver is given.
#pragma once

#include <cmath>
#include <compare>
#include <memory>

#include "collision/narrow_phase/penetration_depth.hpp"
#include "scene/physics/contact_constraint.hpp"
#include "scene/physics/physics_body.hpp"

namespace enfilade::scene {

/// Indices of two solids and of their parts; a < b.
struct PartPairKey {
  std::uint32_t a = 0, b = 0, partA = 0, partB = 0;
  auto operator<=>(const PartPairKey&) const = default;
};

using PatchAnchors = std::array<Vec3, ContactPatch::kMostPoints>;

/// What is known of a pair that came near enough for the narrow phase.
struct CloseUp {
  collision::FeatureCache features;
  std::unique_ptr<collision::DepthCache> depth;  ///< once they penetrated
  double penetration = 0;  ///< metres, when they penetrate: the depth, or an upper bound of it
  ContactPatch patch;      ///< where NearPair::hasPatch; a, b are not set
  PatchAnchors anchors;    ///< of the points, on the free body
  enum class Plane : std::uint8_t { closest, faceOfA, faceOfB } plane = Plane::closest;
};

/// Most pairs are far from one another in every step: they are kept small.
struct NearPair {
  PartPairKey key;
  /// Metres: they are at least this far apart, less what was added to Solid::jumped of both since
  /// its sum was `since`.
  double apart = -1;
  double since = 0;
  Vec3 axis = Vec3::Zero();  ///< world, from A to B, unit: parted them last; zero: none yet
  collision::Verdict verdict = collision::Verdict::separated;  ///< when last looked at
  std::unique_ptr<CloseUp> close;                              ///< null: never asked about

  bool hasPatch = false;
  bool told = false;  ///< it was near when contacts were last told
  bool met = false;   ///< the solver had them meet in the last step, be they apart again

  /// Null: they are far.
  ContactPatch* patch() { return hasPatch ? &close->patch : nullptr; }
  const ContactPatch* patch() const { return hasPatch ? &close->patch : nullptr; }
  double penetration() const {
    return verdict == collision::Verdict::penetrating ? close->penetration : 0;
  }
  collision::FeatureCache features() const {
    return close ? close->features : collision::FeatureCache{};
  }
};

struct NearPairStep {
  double seconds = 0;
  Vec3 gravity = Vec3::Zero();
  double epsilon = 0;
};

/// Looks at the pair where its solids are now: verdict, distance, patch. Does nothing where they
/// were so far apart that they are not taken to come to epsilon within the step, by their speeds of
/// now. Returns whether the narrow phase was asked.
bool look(NearPair& pair, const Solid& a, const Solid& b, const NearPairStep& step);

/// A lower bound of the distance by what was known; may be negative. `moved`: Solid::jumped of
/// both.
inline double apartNow(const NearPair& pair, double moved) {
  const double rounding = 0x1p-51 * (moved + pair.since + std::abs(pair.apart));
  return pair.apart - (moved - pair.since) - rounding;
}
inline double apartNow(const NearPair& pair, const Solid& a, const Solid& b) {
  return apartNow(pair, a.jumped + b.jumped);
}

/// What most pairs need to know of a solid, since they are far from one another: little, and side
/// by side.
struct Pace {
  double speed = 0;   ///< m/s beside a velocity that is the same for all: no point goes faster
  double jumped = 0;  ///< Solid's
  bool isFree = false, isAwake = false, isMoved = false;  ///< Solid's
};
Pace paceOf(const Solid& solid, const Vec3& beside);

/// look() would do nothing but to find them far: proved by their paces.
bool areFar(const NearPair& pair, const Pace& a, const Pace& b, const NearPairStep& step);

/// Whether a free body is inside a driven one, which pressed it against something.
bool isInDriven(const NearPair& pair, const Solid& a, const Solid& b);

/// Whether its shortest way out is not ahead of the driven one: that goes on through it, without
/// friction, and does not take it along.
bool isLetOut(const NearPair& pair, const Solid& a, const Solid& b);

/// Whether the points lean on one another: nearer than 2 epsilon.
bool leans(const NearPair& pair, double epsilon);

}  // namespace enfilade::scene
