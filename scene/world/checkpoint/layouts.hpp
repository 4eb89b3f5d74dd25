// How what a world is made of lies in a checkpoint. A member that is named in a binding and does
// not follow in `a(...)` is worked out when a world is read, or made anew before it is next asked
// for; which of the two is said beside it.
#pragma once

#include "scene/world/checkpoint/archive.hpp"
#include "scene/world/data/world_data.hpp"

namespace enfilade::scene {

template <>
struct MostOf<collision::Verdict> {
  static constexpr auto value = collision::Verdict::penetrating;
};
template <>
struct MostOf<collision::DecidedBy> {
  static constexpr auto value = collision::DecidedBy::rational;
};
template <>
struct MostOf<collision::Feature> {
  static constexpr auto value = collision::Feature::face;
};
template <>
struct MostOf<CloseUp::Plane> {
  static constexpr auto value = CloseUp::Plane::faceOfB;
};
template <>
struct MostOf<LinkJoint::Kind> {
  static constexpr auto value = LinkJoint::Kind::prismatic;
};
template <>
struct MostOf<BodyCommand::Action> {
  static constexpr auto value = BodyCommand::Action::run;
};
template <>
struct MostOf<Sliding> {
  static constexpr auto value = Sliding::stop;
};

// ---- collision ---------------------------------------------------------------------------------

template <>
struct Layout<collision::VertexPair> {
  template <class A>
  static void archive(A& a, Held<A, collision::VertexPair>& pair) {
    auto& [ofA, ofB] = pair;
    a(ofA, ofB);
  }
};

/// Most are of obstacles that were never near, of which nothing is known.
template <>
struct Layout<collision::FeatureCache> {
  template <class A>
  static void archive(A& a, Held<A, collision::FeatureCache>& cache) {
    auto& [pairs, size, axis] = cache;
    bool known = false;
    if constexpr (A::kWrites)
      known = size != 0 || !axis.isZero(0) || pairs != collision::FeatureCache{}.pairs;
    a(known);
    if (!known) return;
    a(pairs, size, axis);
    if constexpr (!A::kWrites)
      if (size < 0 || size > 4) a.refuse("features of " + std::to_string(size) + " pairs");
  }
};

template <>
struct Layout<collision::Decision> {
  template <class A>
  static void archive(A& a, Held<A, collision::Decision>& decision) {
    auto& [verdict, decidedBy, featureA, featureB, distance, errorBound, pointA, pointB, normal] =
        decision;
    a(verdict, decidedBy, featureA, featureB, distance, errorBound, pointA, pointB, normal);
  }
};

template <>
struct Layout<collision::DepthCache> {
  template <class A>
  static void archive(A& a, Held<A, collision::DepthCache>& cache) {
    auto& [vertices, facets] = cache;
    a(vertices, facets);
    if constexpr (!A::kWrites)
      for (const auto& facet : facets)
        for (const std::uint16_t corner : facet)
          if (corner >= vertices.size()) a.refuse("a facet has a corner that is not there");
  }
};

// ---- orders ------------------------------------------------------------------------------------

template <>
struct Layout<LinkJoint> {
  template <class A>
  static void archive(A& a, Held<A, LinkJoint>& joint) {
    auto& [kind, anchor, axis, low, high] = joint;
    a(kind, anchor, axis, low, high);
  }
};
template <>
struct Layout<Link> {
  template <class A>
  static void archive(A& a, Held<A, Link>& link) {
    auto& [parent, joint, points, value] = link;
    a(parent, joint, points, value);
  }
};
template <>
struct Layout<Spawn> {
  template <class A>
  static void archive(A& a, Held<A, Spawn>& spawn) {
    auto& [at, facing, radius, height, flying, parts, links, selfContact] = spawn;
    a(at, facing, radius, height, flying, parts, links, selfContact);
  }
};
template <>
struct Layout<Walk> {
  template <class A>
  static void archive(A& a, Held<A, Walk>& walk) {
    auto& [along, speed] = walk;
    a(along, speed);
  }
};
template <>
struct Layout<Look> {
  template <class A>
  static void archive(A& a, Held<A, Look>& look) {
    auto& [at] = look;
    a(at);
  }
};
template <>
struct Layout<Wait> {
  template <class A>
  static void archive(A& a, Held<A, Wait>& wait) {
    auto& [seconds] = wait;
    a(seconds);
  }
};
template <>
struct Layout<Capture> {
  template <class A>
  static void archive(A& a, Held<A, Capture>& capture) {
    auto& [as] = capture;
    a(as);
  }
};
template <>
struct Layout<Leave> {
  template <class A>
  static void archive(A&, Held<A, Leave>&) {
    static_assert(std::is_empty_v<Leave>);
  }
};
template <>
struct Layout<Drive> {
  template <class A>
  static void archive(A& a, Held<A, Drive>& drive) {
    auto& [velocity] = drive;
    a(velocity);
  }
};
template <>
struct Layout<Jump> {
  template <class A>
  static void archive(A& a, Held<A, Jump>& jump) {
    auto& [height, velocity] = jump;
    a(height, velocity);
  }
};
template <>
struct Layout<Fly> {
  template <class A>
  static void archive(A& a, Held<A, Fly>& fly) {
    auto& [on] = fly;
    a(on);
  }
};
template <>
struct Layout<Crouch> {
  template <class A>
  static void archive(A& a, Held<A, Crouch>& crouch) {
    auto& [height] = crouch;
    a(height);
  }
};
template <>
struct Layout<DriveJoints> {
  template <class A>
  static void archive(A& a, Held<A, DriveJoints>& drive) {
    auto& [to, speed, atOnce] = drive;
    a(to, speed, atOnce);
  }
};
template <>
struct Layout<Command> {
  template <class A>
  static void archive(A& a, Held<A, Command>& command) {
    auto& [avatar, order, tag] = command;
    a(avatar, order, tag);
  }
};
template <>
struct Layout<BodyCommand> {
  template <class A>
  static void archive(A& a, Held<A, BodyCommand>& command) {
    auto& [body, action, to, level, speed] = command;
    a(body, action, to, level, speed);
  }
};
template <>
struct Layout<QueuedOrder> {
  template <class A>
  static void archive(A& a, Held<A, QueuedOrder>& queued) {
    auto& [order, tag] = queued;
    a(order, tag);
  }
};
template <>
struct Layout<Lengths> {
  template <class A>
  static void archive(A& a, Held<A, Lengths>& lengths) {
    auto& [epsilon, stepHeight, nearMiss, walkableNormalY, gravity, speedLimit, pushForce, tick,
           patience, jumpLimit, jointSpeedLimit, sliding] = lengths;
    a(epsilon, stepHeight, nearMiss, walkableNormalY, gravity, speedLimit, pushForce, tick,
      patience, jumpLimit, jointSpeedLimit, sliding);
  }
};

// ---- avatars -----------------------------------------------------------------------------------

template <>
struct Layout<Contact> {
  template <class A>
  static void archive(A& a, Held<A, Contact>& contact) {
    auto& [other, touching, decision, penetration, nearTold, closest, closestTick] = contact;
    a(other, touching, decision, penetration, nearTold);
    if (nearTold) a(closest, closestTick);  // of a near miss only
  }
};

template <>
struct Layout<WalkProgress> {
  template <class A>
  static void archive(A& a, Held<A, WalkProgress>& walk) {
    auto& [leg, nearest, patienceLeft] = walk;
    a(leg, nearest, patienceLeft);
  }
};

/// `box` and `body` follow from where everybody is, `ofBody` from `entity`.
template <>
struct Layout<Obstacle> {
  template <class A>
  static void archive(A& a, Held<A, Obstacle>& obstacle) {
    auto& [entity, part, ofBody, box, body, cache, moreCaches] = obstacle;
    a(entity, part, cache, moreCaches);
  }
};

/// `parent`, `joint`, `hull` and `reach` follow from the spawn order.
template <>
struct Layout<ChainLink> {
  template <class A>
  static void archive(A& a, Held<A, ChainLink>& link) {
    auto& [parent, joint, hull, reach, value, target, stoppedBy] = link;
    a(value, target, stoppedBy);
  }
};

/// The links are there already, and so are `avatarFromBase` and `selfContact`: by the spawn order.
template <>
struct Layout<Chain> {
  template <class A>
  static void archive(A& a, Held<A, Chain>& chain) {
    auto& [links, avatarFromBase, selfContact, speed, patienceLeft] = chain;
    for (auto& link : links) a(link);
    a(speed, patienceLeft);
  }
};

/// Shape, base and chain of an avatar of which what they follow from was read; refuses what no
/// order can have made (checks.cpp).
void shapeAsRead(const Reader& a, Avatar& avatar);

template <>
struct Layout<Avatar> {
  template <class A>
  static void archive(A& a, Held<A, Avatar>& avatar) {
    auto& [id, shape, madeOf, feet, gaze, eyeHeight, fallSpeed, grounded, standsOn, flying, jumping,
           standing, height, radius, base, chain, drive, walk, waitLeft, hangsFor, lastMove, asked,
           resting, stirred, stoppedBy, pairsChanged, atStop, blockedTold, mover, reach, gathered,
           obstacles, meetsBodies, contacts] = avatar;
    a(madeOf, standing, height, radius);
    if constexpr (!A::kWrites) shapeAsRead(a, avatar);  // `shape`, `base`
    a(chain);
    if constexpr (!A::kWrites)
      if (!chain.links.empty()) shape = shapeWith(base, chain);
    a(id, feet, gaze, eyeHeight, fallSpeed, grounded, standsOn, flying, jumping, drive, walk,
      waitLeft, hangsFor, lastMove, asked, resting, stirred, stoppedBy, pairsChanged, atStop,
      blockedTold, mover, reach, gathered, obstacles, meetsBodies, contacts);
  }
};

// ---- bodies ------------------------------------------------------------------------------------

template <>
struct Layout<BodyPlace> {
  template <class A>
  static void archive(A& a, Held<A, BodyPlace>& place) {
    auto& [offset, turn] = place;
    a(offset, turn);
  }
};
template <>
struct Layout<BodyDrive> {
  template <class A>
  static void archive(A& a, Held<A, BodyDrive>& drive) {
    auto& [place, coordinate, rate, target, speed, going, closesIn] = drive;
    a(place, coordinate, rate, target, speed, going, closesIn);
  }
};
/// The places are planned anew before they are asked for; what the snapshot tells is not.
template <>
struct Layout<BodyPlan> {
  template <class A>
  static void archive(A& a, Held<A, BodyPlan>& plan) {
    auto& [stretches, places, coordinate, farthest, swing] = plan;
    a(farthest, swing);
  }
};
/// `id`, `spec`, `shape` and `mover` are as in any world of the scene; `rotation`, `turned` and
/// `partBoxes` follow from the pose. Where it was before is set before it is asked for.
template <>
struct Layout<Body> {
  template <class A>
  static void archive(A& a, Held<A, Body>& body) {
    auto& [id, spec, shape, position, orientation, rotation, turned, partBoxes, positionBefore,
           orientationBefore, velocity, spin, asleep, moved, driven, risesBy, left, blockedBy,
           drive, plan, mover, reach, inside] = body;
    a(position, orientation);
    if constexpr (!A::kWrites) placeBody(body, position, orientation);
    a(velocity, spin, asleep, moved, left, blockedBy, drive, plan, reach, inside);
  }
};

// ---- free bodies -------------------------------------------------------------------------------

template <>
struct Layout<PartPairKey> {
  template <class A>
  static void archive(A& a, Held<A, PartPairKey>& key) {
    auto& [solidA, solidB, partA, partB] = key;
    a(solidA, solidB, partA, partB);
  }
};
template <>
struct Layout<PatchPoint> {
  template <class A>
  static void archive(A& a, Held<A, PatchPoint>& point) {
    auto& [armA, armB, separation, impulse, push] = point;
    a(armA, armB, separation, impulse, push);
  }
};
/// `first`, `second` are set when it is solved.
template <>
struct Layout<ContactPatch> {
  template <class A>
  static void archive(A& a, Held<A, ContactPatch>& patch) {
    auto& [first, second, normal, friction, restitution, points, size, rub, twist, pushSpeed,
           mostPush, pushed] = patch;
    a(normal, friction, restitution, size, rub, twist, pushSpeed, mostPush);
    if constexpr (!A::kWrites)
      if (size > points.size()) a.refuse("a patch of " + std::to_string(size) + " points");
    for (std::size_t i = 0; i < size; ++i) a(points[i]);
  }
};
/// Patch and anchors are the pair's to write: they mean nothing where NearPair::hasPatch is not.
template <>
struct Layout<CloseUp> {
  template <class A>
  static void archive(A& a, Held<A, CloseUp>& close) {
    auto& [features, depth, penetration, patch, anchors, plane] = close;
    a(features, depth, penetration, plane);
  }
};
template <>
struct Layout<NearPair> {
  template <class A>
  static void archive(A& a, Held<A, NearPair>& pair) {
    auto& [key, apart, since, axis, verdict, close, hasPatch, told, met] = pair;
    a(key, apart, since, axis, verdict, close, hasPatch, told);
    if constexpr (!A::kWrites)
      if (!close && (hasPatch || verdict == collision::Verdict::penetrating))
        a.refuse("two solids meet of which nothing is told");
    if (!hasPatch) return;
    a(close->patch);
    for (std::size_t i = 0; i < close->patch.size; ++i) a(close->anchors[i]);
  }
};
template <>
struct Layout<Gait> {
  template <class A>
  static void archive(A& a, Held<A, Gait>& gait) {
    auto& [velocity, spin] = gait;
    a(velocity, spin);
  }
};
/// Inertia, friction and restitution are those of the body; whether it is free is the solid's to
/// write.
template <>
struct Layout<RigidBody> {
  template <class A>
  static void archive(A& a, Held<A, RigidBody>& body) {
    auto& [centre, rotation, velocity, spin, inverseMass, inertia, inverseInertia, friction,
           restitution] = body;
    a(centre, rotation, velocity, spin);
  }
};
/// `hull`, `centreInFrame`, `parts`, `mesh` and `radius` are the shape, which is given to it
/// before.
template <>
struct Layout<Solid> {
  template <class A>
  static void archive(A& a, Held<A, Solid>& solid) {
    auto& [hull, motion, centreInFrame, parts, mesh, radius, asleep, calmFor, pushVelocity,
           mostPush, leash, gaits, pushed, restless, rotation, position, odometer, jumped] = solid;
    bool isFree = solid.isFree();  // one that left the world no longer is
    a(motion, isFree, asleep, calmFor, pushVelocity, mostPush);
    if constexpr (!A::kWrites)
      if (!isFree) motion.inverseMass = 0;
    archiveExtended(a, leash);
    a(gaits, restless, rotation, position, odometer, jumped);
  }
};

}  // namespace enfilade::scene
