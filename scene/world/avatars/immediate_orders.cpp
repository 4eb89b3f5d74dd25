// Jumping, flying, crouching and driving joints: how these orders start, go on and end.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "scene/world/avatars/order_context.hpp"

namespace enfilade::scene {
namespace {

constexpr double kEyesBelowTop = 0.15;  // metres, at most a tenth of the height
// Of epsilon: who stands up keeps this much from what is above; what it leans on is never nearer
// than 7/8 (StoppingBand), so that it does not count as in the way.
constexpr double kHeadroom = 0.75;

void startJump(Avatar& avatar, const Jump& jump, const Lengths& lengths) {
  avatar.jumping = true;
  avatar.grounded = false;
  avatar.standsOn = 0;
  avatar.fallSpeed = -std::sqrt(2 * lengths.gravity * jump.height);
  avatar.walk = {};
  avatar.hangsFor = 0;
}

/// In the air, but not on its way: held by what cannot be stood on.
bool hangs(Avatar& avatar, const Lengths& lengths) {
  const bool goes = avatar.lastMove.norm() > lengths.epsilon;
  avatar.hangsFor = goes ? 0 : avatar.hangsFor + lengths.tick;
  return avatar.hangsFor >= lengths.patience - kTimeRounding;
}

void setHeight(WorldState& world, Avatar& avatar, std::shared_ptr<const AvatarShape> shape,
               double height) {
  wakeLeaning(world, avatar);
  avatar.shape = std::move(shape);
  avatar.height = height;
  avatar.eyeHeight = eyeHeightOf(height);
  avatar.stirred = true;
}

/// What is in the way of an avatar that would have this shape; 0: nothing.
EntityId inTheWayOf(Follower& f, const AvatarShape& shape) {
  const Avatar& avatar = *f.avatar();
  const double clearance = kHeadroom * f.world.lengths.epsilon;
  const Box box = grown(boxAt(shape.box, avatar.feet), 2 * clearance);
  std::vector<Obstacle> obstacles = obstaclesIn(f.world, box, avatar.id);
  EntityId nearest = 0;
  return isFree(shape, avatar.feet, clearance, obstacles, f.count, nearest) ? 0 : nearest;
}

/// Why `chain` cannot be driven so; "" when it can.
std::string jointProblem(const Chain& chain, const DriveJoints& drive) {
  if (chain.links.empty()) return "it has no joints; give links when it spawns";
  if (drive.to.size() > chain.links.size())
    return "to has " + std::to_string(drive.to.size()) + " values for " +
           std::to_string(chain.links.size()) + " joints";
  for (std::size_t i = 0; i < drive.to.size(); ++i) {
    const LinkJoint& joint = chain.links[i].joint;
    if (!drive.to[i] || (*drive.to[i] >= joint.low && *drive.to[i] <= joint.high)) continue;
    return "to[" + std::to_string(i) + "] is " + shortNumber(*drive.to[i]) +
           "; the joint goes from " + shortNumber(joint.low) + " to " + shortNumber(joint.high);
  }
  return "";
}

void startJoints(Chain& chain, const DriveJoints& drive, const Lengths& lengths) {
  for (std::size_t i = 0; i < chain.links.size(); ++i) {
    ChainLink& link = chain.links[i];
    link.target = i < drive.to.size() && drive.to[i] ? *drive.to[i] : link.value;
  }
  chain.speed = drive.speed;
  chain.patienceLeft = lengths.patience;
}

bool arrived(const Chain& chain) {
  return std::all_of(chain.links.begin(), chain.links.end(),
                     [](const ChainLink& link) { return link.value == link.target; });
}

std::string jointValues(const Chain& chain) {
  std::string text = "joints at [";
  for (const ChainLink& link : chain.links)
    text += (text.back() == '[' ? "" : ", ") + shortNumber(link.value);
  return text + "]";
}

EntityId firstStop(const Chain& chain) {
  for (const ChainLink& link : chain.links)
    if (link.stoppedBy != 0) return link.stoppedBy;
  return 0;
}

void endJoints(Chain& chain) {
  chain.speed = 0;
  for (ChainLink& link : chain.links) link.target = link.value;
}

}  // namespace

double eyeHeightOf(double height) {
  return height - std::min(kEyesBelowTop, 0.1 * height);
}

std::string shortNumber(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.3g", value);
  return text.data();
}

Outcome follow(const Jump& jump, Follower& f) {
  Avatar& avatar = *f.avatar();
  if (!avatar.jumping) {
    if (avatar.flying || (!avatar.grounded && hangs(avatar, f.world.lengths))) {
      f.tell(Notice::Kind::refused, avatar.flying ? "who flies does not jump; fly off first"
                                                  : "it hangs on what nobody can jump from");
      avatar.hangsFor = 0;
      return Outcome::ended;
    }
    if (!avatar.grounded) return Outcome::goesOn;  // as after a spawn: it has to land first
    startJump(avatar, jump, f.world.lengths);
    return Outcome::goesOn;
  }
  const bool stuck = !avatar.grounded && hangs(avatar, f.world.lengths);
  if (!avatar.grounded && !stuck) return Outcome::goesOn;
  avatar.jumping = false;
  avatar.walk = {};
  if (stuck) {
    f.tell(Notice::Kind::blocked, "hangs in the air", avatar.stoppedBy);
  } else {
    f.tell(Notice::Kind::done);
  }
  return Outcome::ended;
}

Outcome follow(const Fly& fly, Follower& f) {
  Avatar& avatar = *f.avatar();
  if (fly.on != avatar.flying) {
    avatar.flying = fly.on;
    avatar.grounded = false;  // who alights falls, if only onto what it stands on
    avatar.standsOn = 0;
    avatar.fallSpeed = 0;
    avatar.stirred = true;
  }
  f.tell(Notice::Kind::done);
  return Outcome::ended;
}

Outcome follow(const Crouch& crouch, Follower& f) {
  Avatar& avatar = *f.avatar();
  const double height = crouch.height == 0 ? avatar.standing : crouch.height;
  if (avatar.standing == 0 || !avatar.chain.links.empty()) {
    f.tell(Notice::Kind::refused, "only a prism crouches; this shape is made of parts");
    return Outcome::ended;
  }
  if (!(height >= kLowestCrouch * avatar.standing && height <= avatar.standing)) {
    f.tell(Notice::Kind::refused, "height is " + shortNumber(height) + "; it must lie in " +
                                      shortNumber(kLowestCrouch * avatar.standing) + ".." +
                                      shortNumber(avatar.standing));
    return Outcome::ended;
  }
  auto shape = prismShape(avatar.radius, height, avatar.standing, f.world.lengths);
  // The lower prism lies inside the higher one: only who grows sweeps over something new.
  const EntityId obstacle = height > avatar.height ? inTheWayOf(f, *shape) : 0;
  if (obstacle != 0) {
    f.tell(Notice::Kind::refused, "there is no room to be " + shortNumber(height) + " m high",
           obstacle);
    return Outcome::ended;
  }
  setHeight(f.world, avatar, std::move(shape), height);
  f.tell(Notice::Kind::done);
  return Outcome::ended;
}

Outcome follow(const DriveJoints& drive, Follower& f) {
  Chain& chain = f.avatar()->chain;
  if (chain.speed == 0) {
    if (const std::string why = jointProblem(chain, drive); !why.empty()) {
      f.tell(Notice::Kind::refused, why);
      return Outcome::ended;
    }
    startJoints(chain, drive, f.world.lengths);
    if (!arrived(chain)) return Outcome::goesOn;
  }
  const bool there = arrived(chain);
  if (!there && chain.patienceLeft > kTimeRounding) return Outcome::goesOn;
  if (there) {
    f.tell(Notice::Kind::done, jointValues(chain));
  } else {
    f.tell(Notice::Kind::blocked, jointValues(chain), firstStop(chain));
  }
  endJoints(chain);
  return Outcome::ended;
}

}  // namespace enfilade::scene
