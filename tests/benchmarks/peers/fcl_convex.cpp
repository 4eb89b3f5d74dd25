// Peer: FCL's two convex solvers, called without its dispatch overhead. libccd's GJK and EPA, and
// its own ("indep") at the default and at a tight tolerance.
#include <fcl/narrowphase/detail/gjk_solver_indep.h>
#include <fcl/narrowphase/detail/gjk_solver_libccd.h>

#include "tests/benchmarks/peers/fcl_shapes.hpp"

namespace enfilade::benchmarks {
namespace {

template <typename Solver>
class FclPair : public PairOfBodies {
 public:
  FclPair(const Points& a, const Points& b, const Solver& solver, bool depth)
      : a_(makeFclConvex(a)), b_(makeFclConvex(b)), solver_(solver), depth_(depth) {}

  Answer ask(const RigidTransform& a, const RigidTransform& b) override {
    double distance = 0;
    Vec3 onA, onB;
    try {
      if (depth_) {
        solver_.shapeSignedDistance(*a_, toFcl(a), *b_, toFcl(b), &distance, &onA, &onB);
        return distance > 0 ? makeApart(distance) : collides(-distance);
      }
      const bool parted =
          solver_.shapeDistance(*a_, toFcl(a), *b_, toFcl(b), &distance, &onA, &onB);
      return parted && distance > 0 ? makeApart(distance) : collides();
    } catch (const std::exception&) {
      return {};
    }
  }

 private:
  std::unique_ptr<fcl::Convexd> a_, b_;
  Solver solver_;
  bool depth_;
};

template <typename Solver>
auto bindFclMaker(const Solver& solver, bool depth) {
  return [=](const Points& a, const Points& b) -> std::unique_ptr<PairOfBodies> {
    return std::make_unique<FclPair<Solver>>(a, b, solver, depth);
  };
}

}  // namespace

std::vector<NarrowPhaseMethod> makeFclConvexMethods() {
  const fcl::detail::GJKSolver_libccd<double> ccd;
  fcl::detail::GJKSolver_indep<double> tight;
  tight.gjk_tolerance = 1e-14;
  return {
      {"FCL libccd", false, "distance", false, true, false, bindFclMaker(ccd, false)},
      {"FCL libccd signed", false, "distance or depth", false, true, true, bindFclMaker(ccd, true)},
      {"FCL indep 1e-14", false, "distance", false, true, false, bindFclMaker(tight, false)}};
}

}  // namespace enfilade::benchmarks
