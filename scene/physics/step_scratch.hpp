// Working memory of one step (physics_step.hpp). Private to its files.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "collision/motion/interpolated_motion.hpp"
#include "scene/base/thread_pool.hpp"
#include "scene/physics/body_pair.hpp"
#include "scene/physics/solver.hpp"
#include "scene/physics/step_report.hpp"

namespace enfilade::scene {

inline constexpr std::uint32_t kNoIndex = ~0u;
inline constexpr std::size_t kPairsPerTask = 64;  ///< pairs in one task

/// Motion of a kinematic body, which carries what it touches: x moves to rotation * (x - pivot) +
/// pivot + translation.
struct CarrierMotion {
  std::uint32_t carrier = kNoIndex;  ///< index into `motions`; kNoIndex: none
  Vec3 pivot = Vec3::Zero(), translation = Vec3::Zero();
  collision::Quat rotation = collision::Quat::Identity();
  bool rotates = false;
  Vec3 velocity = Vec3::Zero(),
       angularVelocity = Vec3::Zero();  ///< mean of the carrier in the step

  Vec3 velocityAt(const Vec3& point) const {
    return velocity + angularVelocity.cross(point - pivot);
  }
};

/// Indices of a pair's bodies in `motions`.
struct PairBodies {
  std::uint32_t a = 0, b = 0;
};

/// Each thread reuses one between steps. A scene of loose parts needs some megabytes, and
/// allocating them page by page took 7 % of a step. Only the memory outlives a step.
struct StepScratch {
  void reset(ThreadPool& newPool) {
    pool = &newPool;
    report = {};
    for (std::vector<std::uint32_t>* list :
         {&activePairs, &constrainedPairs, &bodyIndices, &kinematicPenetrations})
      list->clear();
    pairBodies.clear(), motions.clear(), kinematicBodies.clear();
  }

  ThreadPool* pool = nullptr;
  StepReport report;
  static constexpr std::uint8_t kActive = 1, kQueried = 2, kWakes = 4, kTouching = 8,
                                kConstrained = 16, kPenetrates = 32, kParted = 64;
  std::vector<std::uint8_t> pairFlags;  ///< flags of each pair
  bool isTouchingPair(std::uint32_t pair) const { return (pairFlags[pair] & kTouching) != 0; }
  std::vector<std::uint32_t> activePairs;  ///< indices of pairs that were updated or may matter
  std::vector<PairBodies> pairBodies;      ///< of each of `activePairs`
  std::vector<std::uint32_t> constrainedPairs;  ///< those of them with a constraint
  std::vector<SpeedBound> speedBounds;          ///< of each body, at the pair update
  std::vector<std::uint32_t> localIndices;  ///< of each body: its index in `motions`, or kNoIndex
  std::vector<std::uint32_t> bodyIndices;   ///< of each of `motions`: its body
  std::vector<BodyMotion> motions;
  std::vector<KinematicBody> kinematicBodies;
  /// indices into `constraints`: a dynamic body in a kinematic one
  std::vector<std::uint32_t> kinematicPenetrations;
  std::vector<std::uint8_t> released;  ///< of each of `motions`: see isReleased()
  std::vector<ContactConstraint> constraints;
  std::vector<double>
      motionFractions;  ///< of each of `motions`: the fraction of its motion that is kept
  std::vector<std::uint8_t> hasOwnMotion;  ///< of each of `motions`
  std::vector<Vec3> depenetrations;        ///< of each of `motions`: metres
  std::vector<collision::InterpolatedMotion> sweptMotions;
  std::vector<collision::DisplacementBound> motionBounds;  ///< of each of `sweptMotions`
  std::vector<CarrierMotion> carrierMotions;  ///< of each of `motions`: the motion of its carrier
};

}  // namespace enfilade::scene
