// Peer: Bullet in double precision, its quantized BVH of the triangles, and GJK on each triangle
// whose box overlaps the body's.
//
// Bullet has no distance query to a mesh. The box is inflated by the last distance, or doubled
// until a triangle is found within the inflation.
#include <BulletCollision/CollisionShapes/btBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btConvexHullShape.h>
#include <BulletCollision/CollisionShapes/btTriangleMesh.h>
#include <BulletCollision/CollisionShapes/btTriangleShape.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkEpa2.h>

#include "tests/benchmarks/mesh_method.hpp"

namespace enfilade::benchmarks {
namespace {

constexpr double kFirstReach = 0.5;  // metres
constexpr int kMaxDoublings = 20;

btVector3 toBulletVector(const Vec3& v) {
  return {v.x(), v.y(), v.z()};
}

class EachTriangle : public btTriangleCallback {
 public:
  EachTriangle(const btConvexHullShape& body, const btTransform& at) : body_(body), at_(at) {}

  void processTriangle(btVector3* corners, int, int index) override {
    btTriangleShape triangle(corners[0], corners[1], corners[2]);
    triangle.setMargin(0);
    btGjkEpaSolver2::sResults result{};
    const btVector3 guess = corners[0] - at_.getOrigin();
    if (btGjkEpaSolver2::Distance(&body_, at_, &triangle, btTransform::getIdentity(), guess,
                                  result)) {
      nearest = std::min(nearest, result.distance);
    } else {
      nearest = 0;
      met.push_back(static_cast<std::uint32_t>(index));
    }
  }

  double nearest = std::numeric_limits<double>::infinity();
  std::vector<std::uint32_t> met;

 private:
  const btConvexHullShape& body_;
  const btTransform& at_;
};

class BulletMeshQuery : public MeshQuery {
 public:
  BulletMeshQuery(const Points& body, const Triangles& mesh) {
    for (const Vec3& p : body) body_.addPoint(toBulletVector(p), false);
    body_.setMargin(0);
    body_.recalcLocalAabb();
    for (const Triangle& t : mesh) {
      triangles_.addTriangle(toBulletVector(t[0]), toBulletVector(t[1]), toBulletVector(t[2]));
    }
    mesh_ = std::make_unique<btBvhTriangleMeshShape>(&triangles_, true);
  }

  double computeDistance(const RigidTransform& body) override {
    double reach = last_ > 0 ? 1.1 * last_ : kFirstReach;
    for (int k = 0; k < kMaxDoublings; ++k, reach *= 2) {
      const double found = ask(body, reach).nearest;
      if (found <= reach) {
        last_ = found;
        return found;
      }
    }
    return std::numeric_limits<double>::quiet_NaN();
  }
  void findContacts(const RigidTransform& body, std::vector<std::uint32_t>& triangles) override {
    triangles = ask(body, 0).met;
  }
  void forget() override { last_ = 0; }

 private:
  EachTriangle ask(const RigidTransform& body, double reach) const {
    const Mat3& r = body.rotation;
    const btTransform at(btMatrix3x3(r(0, 0), r(0, 1), r(0, 2), r(1, 0), r(1, 1), r(1, 2), r(2, 0),
                                     r(2, 1), r(2, 2)),
                         toBulletVector(body.translation));
    btVector3 low, high;
    body_.getAabb(at, low, high);
    const btVector3 grown(reach, reach, reach);
    EachTriangle each(body_, at);
    mesh_->processAllTriangles(&each, low - grown, high + grown);
    return each;
  }

  btConvexHullShape body_;
  btTriangleMesh triangles_;
  std::unique_ptr<btBvhTriangleMeshShape> mesh_;
  double last_ = 0;
};

}  // namespace

std::vector<MeshMethod> makeBulletMeshMethods() {
  return {{"Bullet bvh", false, true, [](const Points& body, const Triangles& mesh) {
             return std::make_unique<BulletMeshQuery>(body, mesh);
           }}};
}

}  // namespace enfilade::benchmarks
