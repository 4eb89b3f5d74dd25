// Peer: Bullet in double precision. btConvexHullShape::getAabb() turns the box of the body's own
// frame: its cost does not depend on the number of vertices, and its box is not tight.
#include <BulletCollision/CollisionShapes/btConvexHullShape.h>

#include "tests/benchmarks/box_method.hpp"

namespace enfilade::benchmarks {
namespace {

class BulletBoxUpdate : public BoxUpdate {
 public:
  explicit BulletBoxUpdate(const Hull& hull) {
    for (const Vec3& v : hull.vertices) shape_.addPoint({v.x(), v.y(), v.z()}, false);
    shape_.setMargin(0);
    shape_.recalcLocalAabb();
  }

  void update(const std::vector<TurnedPose>& poses, std::vector<Aabb>& boxes) override {
    for (std::size_t k = 0; k < poses.size(); ++k) {
      const Quat& q = poses[k].orientation;
      const Vec3& t = poses[k].translation;
      const btTransform at(btQuaternion(q.x(), q.y(), q.z(), q.w()), {t.x(), t.y(), t.z()});
      btVector3 low, high;
      shape_.getAabb(at, low, high);
      boxes[k] = {Vec3(low.x(), low.y(), low.z()), Vec3(high.x(), high.y(), high.z())};
    }
  }

 private:
  btConvexHullShape shape_;
};

}  // namespace

BoxMethod makeBulletBoxes() {
  return {"Bullet",
          [](const Hull& hull, std::size_t) { return std::make_unique<BulletBoxUpdate>(hull); }};
}

}  // namespace enfilade::benchmarks
