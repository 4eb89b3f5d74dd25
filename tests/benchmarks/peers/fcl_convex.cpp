// Peer: FCL's two convex solvers, called without its dispatch overhead: libccd's GJK and EPA, and
// its own ("indep") at the default and at a tight tolerance.
#include <fcl/geometry/shape/convex.h>
#include <fcl/narrowphase/detail/gjk_solver_indep.h>
#include <fcl/narrowphase/detail/gjk_solver_libccd.h>

#include "collision/shapes/hull.hpp"
#include "tests/benchmarks/narrow_phase_method.hpp"

namespace enfilade::benchmarks {
namespace {

using Shape = fcl::Convexd;
using Transform = fcl::Transform3d;

std::unique_ptr<Shape> shapeOf(const Points& points) {
  const collision::Hull hull = collision::buildHull(points);
  auto vertices = std::make_shared<const std::vector<Vec3>>(hull.vertices);
  auto faces = std::make_shared<std::vector<int>>();
  for (const auto& face : hull.faces) {
    faces->push_back(static_cast<int>(face.size()));
    for (const std::uint32_t vertex : face) faces->push_back(static_cast<int>(vertex));
  }
  return std::make_unique<Shape>(vertices, static_cast<int>(hull.faces.size()), faces);
}

Transform transformOf(const Placement& at) {
  Transform transform = Transform::Identity();
  transform.linear() = at.rotation;
  transform.translation() = at.translation;
  return transform;
}

template <typename Solver>
class FclPair : public PairOfBodies {
 public:
  FclPair(const Points& a, const Points& b, const Solver& solver, bool depth)
      : a_(shapeOf(a)), b_(shapeOf(b)), solver_(solver), depth_(depth) {}

  Answer ask(const Placement& a, const Placement& b) override {
    double distance = 0;
    Vec3 onA, onB;
    try {
      if (depth_) {
        solver_.shapeSignedDistance(*a_, transformOf(a), *b_, transformOf(b), &distance, &onA,
                                    &onB);
        return distance > 0 ? apart(distance) : collides(-distance);
      }
      const bool parted =
          solver_.shapeDistance(*a_, transformOf(a), *b_, transformOf(b), &distance, &onA, &onB);
      return parted && distance > 0 ? apart(distance) : collides();
    } catch (const std::exception&) {
      return {};
    }
  }

 private:
  std::unique_ptr<Shape> a_, b_;
  Solver solver_;
  bool depth_;
};

template <typename Solver>
auto maker(const Solver& solver, bool depth) {
  return [=](const Points& a, const Points& b) -> std::unique_ptr<PairOfBodies> {
    return std::make_unique<FclPair<Solver>>(a, b, solver, depth);
  };
}

}  // namespace

std::vector<NarrowPhaseMethod> fclConvex() {
  const fcl::detail::GJKSolver_libccd<double> ccd;
  fcl::detail::GJKSolver_indep<double> tight;
  tight.gjk_tolerance = 1e-14;
  return {{"FCL libccd", false, "distance", false, true, false, maker(ccd, false)},
          {"FCL libccd signed", false, "distance or depth", false, true, true, maker(ccd, true)},
          {"FCL indep 1e-14", false, "distance", false, true, false, maker(tight, false)}};
}

}  // namespace enfilade::benchmarks
