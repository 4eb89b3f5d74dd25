// Body: pose, motion and contact state of one body in a world. The model defines the bodies; they
// exist as long as the world. Stationary bodies cost nothing.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "collision/broad_phase/sort_and_sweep.hpp"
#include "collision/narrow_phase/narrow_phase.hpp"
#include "scene/world/data/body_shape.hpp"
#include "scene/world/data/snapshot.hpp"

namespace enfilade::scene {

/// In place of an index into WorldData::bodies: no body.
inline constexpr std::uint32_t kNoBody = ~0u;

/// Pose of a kinematic body relative to its authored pose. Within a tick, offset and angle change
/// linearly between two joint poses.
struct JointPose {
  Vec3 offset = Vec3::Zero();  ///< metres, scene frame
  double angle = 0;            ///< radians about the spec's axis through the anchor
};

/// Drive of a kinematic body along its one degree of freedom. Every field is part of the state.
struct KinematicDrive {
  JointPose pose;
  double jointPosition = 0;  ///< position along the degree of freedom; unit as in BodySpec
  double jointVelocity = 0;  ///< per second, signed
  double target = 0;         ///< joint position to reach; unused for a looping path
  double speed = 0;          ///< maximum |jointVelocity|, > 0
  bool moving = false;       ///< towards the target, or along a looping path
  double autoCloseIn = -1;   ///< seconds until it closes by itself; negative: no timer runs
};

/// Solver substeps in a tick.
inline constexpr int kSolverSubsteps = 4;

/// Planned motion of a kinematic body in this tick: key poses at equal time intervals. The body
/// reaches the last key pose unless it is blocked; then it stays where it stopped.
struct KinematicTarget {
  std::size_t segments = 1;  ///< a path has kSolverSubsteps: it may reverse within the tick
  std::array<JointPose, kSolverSubsteps + 1> keyPoses;  ///< [0]: before the tick; [segments]: after
                                                        ///< it
  double jointPosition = 0;                             ///< after the tick
  double maxDisplacement = 0;  ///< metres; upper bound for every point at every time; 0: stationary
  double velocityDeviation = 0;  ///< m/s; maximum deviation from uniform motion (see BodySnapshot)
};

/// Boxes of a body at its pose: scene frame, metres; they contain the exact boxes. The box of a
/// body with several parts comes first; its parts get boxes only while that one overlaps something
/// (Lin 1993, section 5.2.1).
struct BodyBoxes {
  Aabb whole;
  std::vector<Aabb> parts;                        ///< valid while `hasParts`
  bool hasParts = false;                          ///< of a body with one part: always
  std::vector<collision::ExtremalVertices> last;  ///< of the parts, then of the outline

  // Work since the end of the last tick.
  std::uint64_t verticesLookedAt = 0;
  std::uint64_t partBoxesMade = 0;
};

struct Body {
  EntityId id = 0;  ///< id of its first object
  const BodySpec* spec = nullptr;
  std::shared_ptr<const BodyShape> shape;

  // worldFromBody: a point p in body frame maps to rotation * p + position. setBodyPose() sets
  // these.
  Vec3 position = Vec3::Zero();  ///< scene frame, metres; shape->origin in the authored pose
  collision::Quat orientation = collision::Quat::Identity();  ///< unit
  collision::Mat3 rotation = collision::Mat3::Identity();     ///< of `orientation`
  bool isRotated = false;  ///< `rotation` differs from the identity in at least one bit
  BodyBoxes boxes;

  // Moving kinematic body: the pose before the tick.
  Vec3 previousPosition = Vec3::Zero();
  collision::Quat previousOrientation = collision::Quat::Identity();

  Vec3 velocity = Vec3::Zero();         ///< of the body frame's origin, m/s, scene frame
  Vec3 angularVelocity = Vec3::Zero();  ///< rad/s, scene frame
  bool asleep = true;             ///< rigid: stationary until an event wakes it; other kinds: false
  bool moved = false;             ///< in this tick
  double kinematicPushBound = 0;  ///< rigid, metres: maximum distance that a kinematic body may
                                  ///< push or carry it in this tick
  double pendingLift = 0;   ///< rigid, metres: rise of its support in this tick, which the solver
                            ///< will apply; 0 between ticks
  bool outOfWorld = false;  ///< rigid: it left the world and stays where it was removed
  EntityId blockedBy = 0;   ///< entity that a kinematic body cannot push aside; 0: none

  KinematicDrive drive;             ///< kinematic only
  KinematicTarget kinematicTarget;  ///< kinematic only, for this tick

  collision::ProxyId proxy = 0;
  Aabb motionBounds;  ///< contains every place that the body may reach in this tick

  std::vector<EntityId> occupants;  ///< triggers: ids of the entities inside, ascending
};

inline std::uint32_t getPartCount(const Body& body) {
  return static_cast<std::uint32_t>(body.shape->parts.size());
}

/// Sets the pose of a body and updates its box. The boxes of several parts become invalid.
void setBodyPose(Body& body, const Vec3& position, const collision::Quat& orientation);
/// The same for a body at rest: its motion bounds are its box.
void placeBody(Body& body, const collision::Pose& pose);

/// Converts a point from scene frame to body frame.
inline Vec3 toBodyFrame(const Body& body, const Vec3& point) {
  return body.rotation.transpose() * (point - body.position);
}

/// Part `part` as input of the narrow phase. Points into the body.
collision::PlacedConvex makePlacedPart(const Body& body, std::uint32_t part);

/// Makes the boxes of all parts, unless they are valid.
void makePartBoxes(Body& body);

/// The box of one part; it is computed if the boxes of the parts are invalid. That work is not
/// counted: several threads may ask for boxes of the same body.
Aabb getPartBox(const Body& body, std::uint32_t part);

/// World pose of a kinematic body at a joint pose.
collision::Pose computeBodyPose(const BodySpec& spec, const JointPose& jointPose);

/// Joint pose at a position along the degree of freedom.
JointPose computeJointPose(const BodySpec& spec, double jointPosition);

/// Initial pose of a kinematic body.
collision::Pose computeStartPose(const BodySpec& spec);

/// Interpolates linearly from one joint pose to the next; `s` in 0..1.
JointPose interpolateJointPose(const JointPose& from, const JointPose& to, double s);

/// Metres; upper bound of the displacement of any point between two joint poses.
double computeDisplacementBound(const BodyShape& shape, const JointPose& from, const JointPose& to);

}  // namespace enfilade::scene
