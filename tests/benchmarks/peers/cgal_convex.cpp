// Peer: CGAL's distance of polytopes by quadratic programming, exact for its input points, which
// are the world vertices rounded to doubles.
#include <CGAL/Cartesian.h>
#include <CGAL/Gmpzf.h>
#include <CGAL/Polytope_distance_d.h>
#include <CGAL/Polytope_distance_d_traits_3.h>

#include "collision/shapes/hull.hpp"
#include "tests/benchmarks/narrow_phase_method.hpp"

namespace enfilade::benchmarks {
namespace {

using Kernel = CGAL::Cartesian<double>;
using Traits = CGAL::Polytope_distance_d_traits_3<Kernel, CGAL::Gmpzf, double>;
using Distance = CGAL::Polytope_distance_d<Traits>;

std::vector<Kernel::Point_3> placePoints(const Points& vertices, const RigidTransform& at) {
  std::vector<Kernel::Point_3> result;
  for (const Vec3& vertex : vertices) {
    const Vec3 world = at.rotation * vertex + at.translation;
    result.emplace_back(world.x(), world.y(), world.z());
  }
  return result;
}

class CgalPair : public PairOfBodies {
 public:
  CgalPair(const Points& a, const Points& b)
      : a_(collision::buildHull(a).vertices), b_(collision::buildHull(b).vertices) {}

  Answer ask(const RigidTransform& a, const RigidTransform& b) override {
    const auto pointsA = placePoints(a_, a);
    const auto pointsB = placePoints(b_, b);
    const Distance distance(pointsA.begin(), pointsA.end(), pointsB.begin(), pointsB.end());
    if (distance.is_zero()) return collides();
    return makeApart(std::sqrt(CGAL::to_double(distance.squared_distance_numerator()) /
                               CGAL::to_double(distance.squared_distance_denominator())));
  }

 private:
  Points a_, b_;
};

}  // namespace

std::vector<NarrowPhaseMethod> makeCgalConvexMethods() {
  return {{"CGAL polytope distance", false, "distance", false, true, false,
           [](const Points& a, const Points& b) -> std::unique_ptr<PairOfBodies> {
             return std::make_unique<CgalPair>(a, b);
           }}};
}

}  // namespace enfilade::benchmarks
