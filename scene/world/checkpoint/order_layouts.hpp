// Checkpoint layouts of orders and commands.
#pragma once

#include "scene/world/checkpoint/archive.hpp"
#include "scene/world/data/avatar.hpp"

namespace enfilade::scene {

template <>
inline constexpr auto kMaxEnumerator<LinkJoint::Kind> = LinkJoint::Kind::prismatic;
template <>
inline constexpr auto kMaxEnumerator<BodyCommand::Action> = BodyCommand::Action::run;

template <class A>
void archiveMembers(A& a, MaybeConst<A, LinkJoint>& joint) {
  auto& [kind, anchor, axis, low, high] = joint;
  a(kind, anchor, axis, low, high);
}
template <class A>
void archiveMembers(A& a, MaybeConst<A, Link>& link) {
  auto& [parent, joint, points, value] = link;
  a(parent, joint, points, value);
}
template <class A>
void archiveMembers(A& a, MaybeConst<A, Spawn>& spawn) {
  auto& [position, facing, radius, height, flying, parts, links, selfContact] = spawn;
  a(position, facing, radius, height, flying, parts, links, selfContact);
}
/// Names are resolved before a command is stored.
template <class A>
void archiveMembers(A& a, MaybeConst<A, BodyHandle>& body) {
  auto& [name, index] = body;
  a(index);
}
template <class A>
void archiveMembers(A& a, MaybeConst<A, Ride>& ride) {
  auto& [waypoint, lift, level] = ride;
  a(waypoint, lift, level);
}
template <class A>
void archiveMembers(A& a, MaybeConst<A, Walk>& walk) {
  auto& [waypoints, speed, opens, rides, opensFrom, fromFloor] = walk;
  a(waypoints, speed, opens, rides, opensFrom, fromFloor);
}
template <class A>
void archiveMembers(A& a, MaybeConst<A, Look>& look) {
  auto& [target] = look;
  a(target);
}
template <class A>
void archiveMembers(A& a, MaybeConst<A, Wait>& wait) {
  auto& [seconds] = wait;
  a(seconds);
}
template <class A>
void archiveMembers(A& a, MaybeConst<A, Capture>& capture) {
  auto& [name] = capture;
  a(name);
}
template <class A>
void archiveMembers(A&, MaybeConst<A, Leave>&) {
  static_assert(std::is_empty_v<Leave>);
}
template <class A>
void archiveMembers(A& a, MaybeConst<A, Drive>& drive) {
  auto& [velocity] = drive;
  a(velocity);
}
template <class A>
void archiveMembers(A& a, MaybeConst<A, Jump>& jump) {
  auto& [height, velocity] = jump;
  a(height, velocity);
}
template <class A>
void archiveMembers(A& a, MaybeConst<A, Fly>& fly) {
  auto& [on] = fly;
  a(on);
}
template <class A>
void archiveMembers(A& a, MaybeConst<A, Crouch>& crouch) {
  auto& [height] = crouch;
  a(height);
}
template <class A>
void archiveMembers(A& a, MaybeConst<A, DriveJoints>& drive) {
  auto& [targets, speed, immediate] = drive;
  a(targets, speed, immediate);
}
template <class A>
void archiveMembers(A& a, MaybeConst<A, Turn>& turn) {
  auto& [angle, relative, rate] = turn;
  a(angle, relative, rate);
}
template <class A>
void archiveMembers(A& a, MaybeConst<A, Teleport>& teleport) {
  auto& [position, facing] = teleport;
  a(position, facing);
}
template <class A>
void archiveMembers(A& a, MaybeConst<A, Command>& command) {
  auto& [avatar, order, tag] = command;
  a(avatar, order, tag);
}
template <class A>
void archiveMembers(A& a, MaybeConst<A, BodyCommand>& command) {
  auto& [body, action, target, level, speed] = command;
  a(body, action, target, level, speed);
}
template <class A>
void archiveMembers(A& a, MaybeConst<A, QueuedOrder>& queued) {
  auto& [order, tag] = queued;
  a(order, tag);
}
/// `avatar` follows from the names.
template <class A>
void archiveMembers(A& a, MaybeConst<A, OrderQueue>& queue) {
  auto& [name, avatar, orders] = queue;
  a(name, orders);
}

}  // namespace enfilade::scene
