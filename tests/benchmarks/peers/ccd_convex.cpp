// Peer: libccd's Minkowski portal refinement; a verdict and a depth, no distance.
#include <ccd/ccd.h>
#include <ccd/quat.h>

#include "collision/shapes/hull.hpp"
#include "tests/benchmarks/narrow_phase_method.hpp"

namespace enfilade::benchmarks {
namespace {

constexpr unsigned long kMaxIterations = 1000;

struct Shape {
  Points vertices;
  Vec3 centre = Vec3::Zero();
  const RigidTransform* at = nullptr;
};

Vec3 toVector(const ccd_vec3_t& v) {
  return {ccdVec3X(&v), ccdVec3Y(&v), ccdVec3Z(&v)};
}

void findSupport(const void* object, const ccd_vec3_t* direction, ccd_vec3_t* result) {
  const Shape& shape = *static_cast<const Shape*>(object);
  const Vec3 local = shape.at->rotation.transpose() * toVector(*direction);
  const Vec3* best = &shape.vertices.front();
  double maxHeight = best->dot(local);
  for (const Vec3& vertex : shape.vertices) {
    const double height = vertex.dot(local);
    if (height > maxHeight) {
      maxHeight = height;
      best = &vertex;
    }
  }
  const Vec3 world = shape.at->rotation * *best + shape.at->translation;
  ccdVec3Set(result, world.x(), world.y(), world.z());
}

void computeCentre(const void* object, ccd_vec3_t* result) {
  const Shape& shape = *static_cast<const Shape*>(object);
  const Vec3 world = shape.at->rotation * shape.centre + shape.at->translation;
  ccdVec3Set(result, world.x(), world.y(), world.z());
}

Shape makeShape(const Points& points) {
  Shape shape{collision::buildHull(points).vertices};
  for (const Vec3& vertex : shape.vertices) {
    shape.centre += vertex / static_cast<double>(shape.vertices.size());
  }
  return shape;
}

class CcdPair : public PairOfBodies {
 public:
  CcdPair(const Points& a, const Points& b, bool depth)
      : a_(makeShape(a)), b_(makeShape(b)), depth_(depth) {
    CCD_INIT(&ccd_);
    ccd_.support1 = ccd_.support2 = findSupport;
    ccd_.center1 = ccd_.center2 = computeCentre;
    ccd_.max_iterations = kMaxIterations;
  }

  Answer ask(const RigidTransform& a, const RigidTransform& b) override {
    a_.at = &a;
    b_.at = &b;
    if (!depth_)
      return ccdMPRIntersect(&a_, &b_, &ccd_) != 0 ? collides() : makeApartWithoutDistance();
    double depth = 0;
    ccd_vec3_t direction, position;
    const int parted = ccdMPRPenetration(&a_, &b_, &ccd_, &depth, &direction, &position);
    return parted == 0 ? collides(depth) : makeApartWithoutDistance();
  }

 private:
  static Answer makeApartWithoutDistance() {
    Answer answer;
    answer.verdict = Answer::Verdict::apart;
    return answer;
  }

  Shape a_, b_;
  bool depth_;
  ccd_t ccd_;
};

auto bindCcdMaker(bool depth) {
  return [depth](const Points& a, const Points& b) -> std::unique_ptr<PairOfBodies> {
    return std::make_unique<CcdPair>(a, b, depth);
  };
}

}  // namespace

std::vector<NarrowPhaseMethod> makeCcdConvexMethods() {
  return {{"libccd MPR", false, "verdict", false, false, false, bindCcdMaker(false)},
          {"libccd MPR with depth", false, "verdict and depth", false, false, true,
           bindCcdMaker(true)}};
}

}  // namespace enfilade::benchmarks
