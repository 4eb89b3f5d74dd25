// What belongs to one step of dynamics.hpp. Private to its files.
#pragma once

#include "scene/physics/physics_world.hpp"
#include "scene/physics/swept_pose.hpp"
#include "scene/physics/thread_pool.hpp"

namespace enfilade::scene {

inline constexpr std::uint32_t kNoPlace = ~0u;
inline constexpr std::size_t kPairBlock = 64;  ///< pairs that a thread takes at a time

/// The way of a driven body, which takes along what it pushes: x goes to
/// turn * (x - pivot) + pivot + shift.
struct Carry {
  std::uint32_t by = kNoPlace;  ///< which of `bodies`; kNoPlace: nobody carries
  Vec3 pivot = Vec3::Zero(), shift = Vec3::Zero();
  collision::Quat turn = collision::Quat::Identity();
  bool turns = false;
  Vec3 velocity = Vec3::Zero(), spin = Vec3::Zero();  ///< the carrier's, mean of the step

  Vec3 velocityAt(const Vec3& point) const { return velocity + spin.cross(point - pivot); }
};

/// The bodies of a pair, by their places in `bodies`.
struct PairBodies {
  std::uint32_t a = 0, b = 0;
};

/// Kept by each thread from step to step, since a tray of parts needs some megabytes: to ask the
/// system for them anew, page by page, took 7 % of a step. Nothing in it outlives a step but room.
struct StepWork {
  void begin(Workers& all) {
    workers = &all;
    report = {};
    for (std::vector<std::uint32_t>* list : {&active, &patched, &solids, &jointOf, &inside})
      list->clear();
    bodiesOf.clear(), bodies.clear(), driven.clear(), joints.clear();
  }

  Workers* workers = nullptr;
  DynamicsReport report;
  static constexpr std::uint8_t kActive = 1, kAsked = 2, kWakes = 4, kLeans = 8, kPatched = 16,
                                kPenetrates = 32;
  std::vector<std::uint8_t> looks;  ///< of each pair, these flags
  bool leans(std::uint32_t pair) const { return (looks[pair] & kLeans) != 0; }
  std::vector<std::uint32_t> active;   ///< indices of pairs that were looked at or may matter
  std::vector<PairBodies> bodiesOf;    ///< of each of `active`
  std::vector<std::uint32_t> patched;  ///< of those, with a patch
  std::vector<Pace> paces;             ///< of each solid, when pairs are looked at
  std::vector<std::uint32_t> local;    ///< of each solid: its place in `bodies`; kNoPlace: none
  std::vector<std::uint32_t> solids;   ///< of each of `bodies`
  std::vector<RigidBody> bodies;
  std::vector<DrivenBody> driven;
  std::vector<std::uint32_t> inside;  ///< of `patches`: of a free body in a driven one
  std::vector<std::uint8_t> letOut;   ///< of each of `bodies`: see isLetOut()
  std::vector<ContactPatch> patches;
  std::vector<Joint> joints;
  std::vector<std::uint32_t> jointOf;
  std::vector<double> fractions;     ///< of each of `bodies`, of its way
  std::vector<std::uint8_t> yields;  ///< of each of `bodies`: it has some way of its own left
  std::vector<Vec3> partings;        ///< of each of `bodies`: metres, out of what is too near
  std::vector<Passage> passages;
  std::vector<Stride> strides;  ///< of these
  std::vector<Carry> carried;   ///< of each of `bodies`: the way that it goes in any case
};

/// Step 3: the ways to where the solver has the bodies, as far as they are proved (ways.cpp).
void proveWays(const Dynamics& dynamics, double seconds, double epsilon, StepWork& work);

}  // namespace enfilade::scene
