#include "scene/world/avatars/turning.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "collision/sine_cosine.hpp"
#include "scene/model/rotation.hpp"
#include "scene/world/avatars/avatar_state.hpp"
#include "scene/world/avatars/rigid_step.hpp"
#include "scene/world/avatars/spawn.hpp"

namespace enfilade::scene {
namespace {

constexpr double kMinTurnFraction = 1e-6;  // of a tick's turn: minimum that counts as progress

/// The facing of a direction, degrees in -180..180; 0 if it is vertical. By bisection, because
/// libm's arc tangent differs between processors.
double computeFacing(const Vec3& direction) {
  const bool isLeft = direction.z() <= 0;  // of +X
  double low = isLeft ? 0 : -180, high = isLeft ? 180 : 0;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    const Vec3 heading = makeHeadingFromDegrees(middle);
    const double left = heading.z() * direction.x() - heading.x() * direction.z();
    (left > 0 ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

/// Parts that turn with the avatar; a prism does not.
std::uint64_t findTurnedParts(const Avatar& avatar) {
  const std::size_t count = avatar.shape->parts.size();
  const std::size_t first = avatar.spawnHeight > 0 ? count - avatar.chain.links.size() : 0;
  std::uint64_t parts = 0;
  for (std::size_t i = first; i < count; ++i) parts |= std::uint64_t{1} << i;
  return parts;
}

/// Turns parts and links by `angle` degrees, or up to the first hit. Returns the fraction made.
double turnParts(const WorldSettings& settings, Avatar& avatar, double angle, QueryCount& count) {
  RigidStep step;
  step.movedParts = findTurnedParts(avatar);
  step.isRotation = true;
  step.pivot = avatar.footPosition;
  step.delta = angle * collision::kRadiansPerDegree;
  step.maxDisplacement = std::abs(step.delta) * computeTurnRadius(avatar);
  const RigidStepHit hit = castRigidStep(settings, avatar, step, count);
  avatar.turn.blockedBy = hit.entity;
  recordStepHit(avatar, hit);
  setFacing(avatar, std::remainder(avatar.facing + hit.fraction * angle, 360));
  return hit.fraction;
}

void startTurn(const Turn& order, const WorldSettings& settings, Avatar& avatar) {
  TurnProgress& turn = avatar.turn;
  turn.heading = turnsShape(avatar) ? avatar.facing : computeFacing(avatar.viewDirection);
  turn.left = order.relative ? order.angle : std::remainder(order.angle - turn.heading, 360);
  turn.rate = order.rate;
  turn.timeoutLeft = settings.stuckTimeout;
  avatar.viewHeld = true;
}

}  // namespace

OrderStatus executeOrder(const Turn& order, OrderContext& context) {
  Avatar& avatar = *context.findAvatar();
  if (avatar.turn.rate == 0) startTurn(order, context.world.settings, avatar);
  const TurnProgress turn = avatar.turn;
  if (turn.left != 0 && turn.timeoutLeft > kTimeTolerance) return OrderStatus::running;
  avatar.turn = {};
  if (turn.left == 0) {
    context.emitNotice(Notice::Kind::done);
  } else {
    context.emitNotice(Notice::Kind::blocked,
                       formatShortNumber(std::abs(turn.left)) + " degrees are left",
                       turn.blockedBy);
  }
  return OrderStatus::done;
}

double computeMaxTurnDisplacement(const WorldSettings& settings, const Avatar& avatar) {
  if (avatar.turn.left == 0) return 0;
  const double angle =
      std::min(std::abs(avatar.turn.left), avatar.turn.rate * settings.tickDuration);
  return angle * collision::kRadiansPerDegree * computeTurnRadius(avatar);
}

void turnAvatar(const WorldSettings& settings, Avatar& avatar, QueryCount& count) {
  TurnProgress& turn = avatar.turn;
  const double maxAngle = turn.rate * settings.tickDuration;
  const double angle = std::max(-maxAngle, std::min(maxAngle, turn.left));
  const double fraction = turnsShape(avatar) ? turnParts(settings, avatar, angle, count) : 1;
  turn.left = fraction == 1 ? turn.left - angle : turn.left - fraction * angle;
  turn.heading =
      turnsShape(avatar) ? avatar.facing : std::remainder(turn.heading + fraction * angle, 360);
  setViewFacing(avatar, turn.heading);
  turn.timeoutLeft = fraction > kMinTurnFraction ? settings.stuckTimeout
                                                 : turn.timeoutLeft - settings.tickDuration;
}

void setViewFacing(Avatar& avatar, double degrees) {
  const Vec3 view = avatar.viewDirection;
  const double across = std::sqrt(view.x() * view.x() + view.z() * view.z());
  avatar.viewDirection = across * makeHeadingFromDegrees(degrees) + Vec3(0, view.y(), 0);
}

}  // namespace enfilade::scene
