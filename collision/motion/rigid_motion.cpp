#include "collision/motion/rigid_motion.hpp"

#include "collision/motion/moving_pose.hpp"
#include "collision/sine_cosine.hpp"

namespace enfilade::collision {

RigidTransform computeTransformAfter(const PlacedConvex& body, const AxisRotation& rotation,
                                     double fraction) {
  const Vec3 angularVelocity = rotation.angle * rotation.axis;
  const Mat3 increment = integrateRotation(Mat3::Identity(), angularVelocity, fraction);
  return {body.rotation ? integrateRotation(*body.rotation, angularVelocity, fraction) : increment,
          rotation.pivot + increment * (body.translation - rotation.pivot)};
}

RigidTransform computeTransformAfter(const ScrewMotion& motion, double fraction) {
  const Vec3 position = motion.position + fraction * motion.translation;
  if (motion.angle == 0 || fraction == 0) return {motion.rotation, position};
  const Quat turn = makeAxisRotation(motion.axis, fraction * motion.angle).normalized();
  return {turn.toRotationMatrix() * motion.rotation, position};
}

}  // namespace enfilade::collision
