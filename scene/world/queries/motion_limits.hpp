// Upper bounds of the speed of avatars and bodies under any command that a client may send.
#pragma once

#include <span>

#include "scene/model/body_spec.hpp"
#include "scene/world/data/snapshot.hpp"
#include "scene/world/data/world_settings.hpp"
#include "scene/world/queries/entity_index.hpp"

namespace enfilade::scene {

/// Maximum displacement of an avatar per displacement of a body. A push is at most 1 / 0.714 of the
/// latter, since it is horizontal although the normal is not (bodies/kinematic_motion.cpp). The
/// body also carries the avatar.
inline constexpr double kMaxPushFactor = 2.5;

/// True if the avatar stands on a dynamic body: a distant body may carry both.
bool standsOnDynamicBody(const SceneAt& sceneAt, const AvatarSnapshot& avatar);

/// Maximum speed at which the joints move any point of the avatar's chain, m/s.
double sumJointSpeeds(const AvatarSnapshot& avatar, const WorldSettings& settings);

/// Maximum speed of any point of a body, m/s; `radius` in metres. Infinity for dynamic bodies, 0
/// for triggers.
double computeBodySpeedLimit(const BodySpec& spec, double radius, const WorldSettings& settings);

/// Maximum speed of an avatar by itself, m/s: it walks, steps, jumps or falls, moves its joints,
/// and keeps its contact offset.
double computeAvatarSpeedLimit(const AvatarSnapshot& avatar, const WorldSettings& settings);

/// Metres by which an avatar may grow at once: it may have crouched.
double computeGrowthLimit(const AvatarSnapshot& avatar);

/// A kinematic body, which may push or carry avatars.
struct AvatarPusher {
  Aabb box;          ///< scene frame, metres
  double speed = 0;  ///< maximum of any point, m/s
};

/// Maximum speed of an avatar during the next `seconds` (> 0, may be infinite), m/s. It is its own
/// and that of all `pushers` that can reach it by then. `onDynamicBody`: all of them count, because
/// a distant one may carry what it stands on.
double computeAvatarSpeedWithin(const AvatarSnapshot& avatar, std::span<const AvatarPusher> pushers,
                                bool onDynamicBody, const WorldSettings& settings, double seconds);

}  // namespace enfilade::scene
