// Peer: Bullet in double precision, GJK and EPA (btGjkEpaSolver2) on convex hulls without margin;
// warm queries start from the last separating direction.
#include <BulletCollision/CollisionShapes/btConvexHullShape.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkEpa2.h>

#include "collision/shapes/hull.hpp"
#include "tests/benchmarks/narrow_phase_method.hpp"

namespace enfilade::benchmarks {
namespace {

void fill(btConvexHullShape& shape, const Points& points) {
  for (const Vec3& p : collision::buildHull(points).vertices) {
    shape.addPoint(btVector3(p.x(), p.y(), p.z()), false);
  }
  shape.setMargin(0);
  shape.recalcLocalAabb();
}

btTransform toTransform(const RigidTransform& at) {
  const Mat3& r = at.rotation;
  const Vec3& t = at.translation;
  const btMatrix3x3 rotation(r(0, 0), r(0, 1), r(0, 2), r(1, 0), r(1, 1), r(1, 2), r(2, 0), r(2, 1),
                             r(2, 2));
  return btTransform(rotation, btVector3(t.x(), t.y(), t.z()));
}

class BulletPair : public PairOfBodies {
 public:
  BulletPair(const Points& a, const Points& b, bool depth) : depth_(depth) {
    fill(a_, a);
    fill(b_, b);
  }
  void forget() override { known_ = false; }

  Answer ask(const RigidTransform& a, const RigidTransform& b) override {
    const btTransform atA = toTransform(a);
    const btTransform atB = toTransform(b);
    btVector3 guess = known_ ? guess_ : atB.getOrigin() - atA.getOrigin();
    if (guess.length2() == 0) guess = btVector3(1, 0, 0);
    btGjkEpaSolver2::sResults result{};
    if (btGjkEpaSolver2::Distance(&a_, atA, &b_, atB, guess, result)) {
      keep(result.witnesses[0] - result.witnesses[1]);
      return makeApart(result.distance);
    }
    known_ = false;
    if (!depth_) return collides();
    if (btGjkEpaSolver2::Penetration(&a_, atA, &b_, atB, guess, result, false)) {
      return collides(-result.distance);
    }
    return collides();  // collides, but the depth was not found
  }

 private:
  void keep(const btVector3& direction) {
    known_ = direction.length2() > 0;
    guess_ = direction;
  }

  btConvexHullShape a_, b_;
  bool depth_, known_ = false;
  btVector3 guess_{1, 0, 0};
};

auto bindBulletMaker(bool depth) {
  return [depth](const Points& a, const Points& b) -> std::unique_ptr<PairOfBodies> {
    return std::make_unique<BulletPair>(a, b, depth);
  };
}

}  // namespace

std::vector<NarrowPhaseMethod> makeBulletConvexMethods() {
  return {{"Bullet GjkEpa2", false, "distance", true, true, false, bindBulletMaker(false)},
          {"Bullet GjkEpa2 with depth", false, "distance or depth", true, true, true,
           bindBulletMaker(true)}};
}

}  // namespace enfilade::benchmarks
