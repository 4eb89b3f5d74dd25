// A body in a world: where it is, how it moves, and what it met. The model says which bodies there
// are; they stay as long as the world does. Those that stand cost nothing.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "collision/broad_phase/sort_and_sweep.hpp"
#include "scene/world/contacts/obstacles.hpp"
#include "scene/world/data/body_shape.hpp"

namespace enfilade::scene {

/// Where a kinematic body is, relative to its authored place. Between two of these, within a tick,
/// both change evenly.
struct BodyPlace {
  Vec3 offset = Vec3::Zero();  ///< metres, scene frame
  double turn = 0;             ///< radians about the spec's axis through the anchor
};

/// A contact that lasts, or a near miss.
struct Contact {
  EntityId other = 0;
  bool touching = false;  ///< closer than 2 epsilon; else a near miss that was told
  collision::Decision decision;
  double penetration = 0;       ///< metres; the depth, or an upper bound of it
  bool nearTold = false;        ///< a near miss is under way
  collision::Decision closest;  ///< of the near miss so far
  std::uint64_t closestTick = 0;
};

/// What a kinematic body is about. All of it is part of the state.
struct BodyDrive {
  BodyPlace place;
  double coordinate = 0;  ///< along its one degree of freedom, as the spec says
  double rate = 0;        ///< of the coordinate, per second; signed
  double target = 0;      ///< coordinate that it goes to; of no meaning for a path that loops
  double speed = 0;       ///< most |rate|, > 0
  bool going = false;     ///< to its target, or round its path
  double closesIn = -1;   ///< seconds; negative: it stays as it is
};

/// Of a tick.
inline constexpr int kSolverSubsteps = 4;

/// Where a kinematic body wants to go in this tick: from place to place, in equal times. It gets to
/// the last one unless it is blocked; what it did not reach is then where it stays.
struct BodyPlan {
  std::size_t stretches = 1;  ///< of a path kSolverSubsteps: it may turn back within the tick
  std::array<BodyPlace, kSolverSubsteps + 1> places;  ///< [0]: before; [stretches]: after the tick
  double coordinate = 0;                              ///< after the tick
  double farthest = 0;  ///< metres: no point is farther off at any time; 0: it does not move
  double swing = 0;     ///< m/s: no point departs faster from going evenly; BodyView::swing
};

struct Body {
  EntityId id = 0;  ///< of its first object
  const BodySpec* spec = nullptr;
  std::shared_ptr<const BodyShape> shape;

  // worldFromBody: a point p of the body's frame is at rotation * p + position. Set by placeBody().
  Vec3 position = Vec3::Zero();  ///< scene frame, metres; shape->origin where it was authored
  collision::Quat orientation = collision::Quat::Identity();  ///< unit
  collision::Mat3 rotation = collision::Mat3::Identity();     ///< of `orientation`
  bool turned = false;         ///< `rotation` is not the identity to the last bit
  std::vector<Box> partBoxes;  ///< scene frame; at least the exact ones

  // Of a kinematic body that goes: where it was before the tick moved it.
  Vec3 positionBefore = Vec3::Zero();
  collision::Quat orientationBefore = collision::Quat::Identity();

  Vec3 velocity = Vec3::Zero();  ///< of the origin of its frame, m/s, scene frame
  Vec3 spin = Vec3::Zero();      ///< rad/s, scene frame
  bool asleep = true;            ///< rigid: stands until something wakes it; others: false
  bool moved = false;            ///< in this tick
  double driven = 0;             ///< rigid, metres: so far a driven one may push or carry it now
  double risesBy = 0;            ///< rigid, metres: so far what it rests on rose in this tick, and
                                 ///< the solver will lift it; 0 between ticks
  bool left = false;             ///< rigid: it left the world, and stays where it was caught
  EntityId blockedBy = 0;        ///< what a kinematic body cannot push aside; 0: nothing

  BodyDrive drive;  ///< kinematic
  BodyPlan plan;    ///< kinematic, of this tick

  collision::MoverId mover = 0;
  Box reach;  ///< what it can meet in this tick

  std::vector<EntityId> inside;  ///< triggers: who is in it, ascending
};

/// Puts a body somewhere: pose and boxes.
void placeBody(Body& body, const Vec3& position, const collision::Quat& orientation);

/// A point of the scene's frame in the body's.
inline Vec3 inBody(const Body& body, const Vec3& point) {
  return body.rotation.transpose() * (point - body.position);
}

/// Part `part` as the narrow phase takes it. Points into the body.
collision::ConvexBody partOf(const Body& body, std::uint32_t part);

/// Of all parts, scene frame.
Box boxOf(const Body& body);

/// The pose that a kinematic body has at a place.
collision::Pose poseAt(const BodySpec& spec, const BodyPlace& place);

/// A part `s` of the way from one place to the next.
BodyPlace placeBetween(const BodyPlace& from, const BodyPlace& to, double s);

/// Metres: no point of the body goes farther from one place to the other.
double farthestWay(const BodyShape& shape, const BodyPlace& from, const BodyPlace& to);

}  // namespace enfilade::scene
