// Checkpoint layouts of orders and commands.
#pragma once

#include "scene/world/checkpoint/archive.hpp"
#include "scene/world/data/avatar.hpp"

namespace enfilade::scene {

template <>
struct MaxEnumerator<LinkJoint::Kind> {
  static constexpr auto value = LinkJoint::Kind::prismatic;
};
template <>
struct MaxEnumerator<BodyCommand::Action> {
  static constexpr auto value = BodyCommand::Action::run;
};

template <>
struct Layout<LinkJoint> {
  template <class A>
  static void archive(A& a, MaybeConst<A, LinkJoint>& joint) {
    auto& [kind, anchor, axis, low, high] = joint;
    a(kind, anchor, axis, low, high);
  }
};
template <>
struct Layout<Link> {
  template <class A>
  static void archive(A& a, MaybeConst<A, Link>& link) {
    auto& [parent, joint, points, value] = link;
    a(parent, joint, points, value);
  }
};
template <>
struct Layout<Spawn> {
  template <class A>
  static void archive(A& a, MaybeConst<A, Spawn>& spawn) {
    auto& [position, facing, radius, height, flying, parts, links, selfContact] = spawn;
    a(position, facing, radius, height, flying, parts, links, selfContact);
  }
};
template <>
struct Layout<Ride> {
  template <class A>
  static void archive(A& a, MaybeConst<A, Ride>& ride) {
    auto& [waypoint, lift, level] = ride;
    a(waypoint, lift, level);
  }
};
template <>
struct Layout<Walk> {
  template <class A>
  static void archive(A& a, MaybeConst<A, Walk>& walk) {
    auto& [waypoints, speed, opens, rides] = walk;
    a(waypoints, speed, opens, rides);
  }
};
template <>
struct Layout<Look> {
  template <class A>
  static void archive(A& a, MaybeConst<A, Look>& look) {
    auto& [target] = look;
    a(target);
  }
};
template <>
struct Layout<Wait> {
  template <class A>
  static void archive(A& a, MaybeConst<A, Wait>& wait) {
    auto& [seconds] = wait;
    a(seconds);
  }
};
template <>
struct Layout<Capture> {
  template <class A>
  static void archive(A& a, MaybeConst<A, Capture>& capture) {
    auto& [name] = capture;
    a(name);
  }
};
template <>
struct Layout<Leave> {
  template <class A>
  static void archive(A&, MaybeConst<A, Leave>&) {
    static_assert(std::is_empty_v<Leave>);
  }
};
template <>
struct Layout<Drive> {
  template <class A>
  static void archive(A& a, MaybeConst<A, Drive>& drive) {
    auto& [velocity] = drive;
    a(velocity);
  }
};
template <>
struct Layout<Jump> {
  template <class A>
  static void archive(A& a, MaybeConst<A, Jump>& jump) {
    auto& [height, velocity] = jump;
    a(height, velocity);
  }
};
template <>
struct Layout<Fly> {
  template <class A>
  static void archive(A& a, MaybeConst<A, Fly>& fly) {
    auto& [on] = fly;
    a(on);
  }
};
template <>
struct Layout<Crouch> {
  template <class A>
  static void archive(A& a, MaybeConst<A, Crouch>& crouch) {
    auto& [height] = crouch;
    a(height);
  }
};
template <>
struct Layout<DriveJoints> {
  template <class A>
  static void archive(A& a, MaybeConst<A, DriveJoints>& drive) {
    auto& [targets, speed, immediate] = drive;
    a(targets, speed, immediate);
  }
};
template <>
struct Layout<Turn> {
  template <class A>
  static void archive(A& a, MaybeConst<A, Turn>& turn) {
    auto& [angle, relative, rate] = turn;
    a(angle, relative, rate);
  }
};
template <>
struct Layout<Teleport> {
  template <class A>
  static void archive(A& a, MaybeConst<A, Teleport>& teleport) {
    auto& [position, facing] = teleport;
    a(position, facing);
  }
};
template <>
struct Layout<Command> {
  template <class A>
  static void archive(A& a, MaybeConst<A, Command>& command) {
    auto& [avatar, order, tag] = command;
    a(avatar, order, tag);
  }
};
template <>
struct Layout<BodyCommand> {
  template <class A>
  static void archive(A& a, MaybeConst<A, BodyCommand>& command) {
    auto& [body, action, target, level, speed] = command;
    a(body, action, target, level, speed);
  }
};
template <>
struct Layout<QueuedOrder> {
  template <class A>
  static void archive(A& a, MaybeConst<A, QueuedOrder>& queued) {
    auto& [order, tag] = queued;
    a(order, tag);
  }
};
/// `avatar` follows from the names.
template <>
struct Layout<OrderQueue> {
  template <class A>
  static void archive(A& a, MaybeConst<A, OrderQueue>& queue) {
    auto& [name, avatar, orders] = queue;
    a(name, orders);
  }
};

}  // namespace enfilade::scene
