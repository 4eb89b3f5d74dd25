// Whether two parts stay clear of one another while both move and turn: proved, not sampled.
#pragma once

#include "collision/narrow_phase/narrow_phase.hpp"
#include "scene/physics/physics_body.hpp"

namespace enfilade::scene {

/// A solid's way within a step: its centre goes straight and it turns evenly, by the shorter way,
/// from one rotation to the other.
struct Passage {
  Vec3 fromCentre = Vec3::Zero(), toCentre = Vec3::Zero();
  collision::Quat fromRotation = collision::Quat::Identity();
  collision::Quat toRotation = collision::Quat::Identity();
  double radius = 0;                  ///< about the centre: no vertex is farther, metres
  Vec3 centreInFrame = Vec3::Zero();  ///< of the parts' frame
  const Solid* stands = nullptr;      ///< it does not move: its frame is there to the last bit
  double turn = 0;                    ///< radians, at least; set by measure()
  /// Of the frame, at both ends; set by measure().
  Mat3 fromTurned = Mat3::Identity(), toTurned = Mat3::Identity();
  Vec3 fromPosition = Vec3::Zero(), toPosition = Vec3::Zero();
};

/// The way of a solid that stands.
Passage standing(const Solid& solid);

/// To be called when centres or rotations were set.
void measure(Passage& passage);

/// Metres: no point goes farther on this way.
double lengthOf(const Passage& passage);

/// What of a way decides how far it takes two from or to one another.
struct Stride {
  Vec3 way = Vec3::Zero();  ///< of the centre, metres
  double tip = 0;           ///< metres: no point goes farther by the turn
};
Stride strideOf(const Passage& passage);

/// Metres: the distance of the two changes by no more.
double closingOf(const Stride& a, const Stride& b);
inline double closingOf(const Passage& a, const Passage& b) {
  return closingOf(strideOf(a), strideOf(b));
}

/// Where the passage is at its middle, exactly half way in both place and turn.
struct PassagePose {
  Vec3 centre = Vec3::Zero();
  collision::Quat rotation = collision::Quat::Identity();
};
PassagePose middleOf(const Passage& passage);

/// The first half, the second half.
Passage firstHalf(const Passage& passage, const PassagePose& middle);
Passage secondHalf(const Passage& passage, const PassagePose& middle);

/// The first `fraction` of a passage: a multiple of 2^-kMostHalvings.
Passage firstPart(const Passage& passage, double fraction);

/// Up to which part of the way the plane at right angles to `axis` (unit, from A to B) parts the
/// two: a cheap proof. 0: the plane is used up at once; negative: it says nothing.
double clearAlong(const PartShape& partA, const Passage& a, const PartShape& partB,
                  const Passage& b, const Vec3& axis);

/// Whether they are separated where their ways end.
bool separatedAtEnd(const PartShape& partA, const Passage& a, const PartShape& partB,
                    const Passage& b, collision::FeatureCache cache);

struct Clearance {
  double fraction = 1;        ///< proved clear up to here: a multiple of 2^-kMostHalvings, or 0
  std::uint32_t queries = 0;  ///< narrow-phase queries
};
inline constexpr int kMostHalvings = 6;

/// How far both parts can go, both at the same part of their ways, with the bodies separated all
/// the way. `cache`: of decide() at the start or before. `apart`: metres by which they are proved
/// to be apart at the start; 0 where that has to be found out.
Clearance clearance(const PartShape& partA, const Passage& a, const PartShape& partB,
                    const Passage& b, const collision::FeatureCache& cache, double apart = 0);

}  // namespace enfilade::scene
