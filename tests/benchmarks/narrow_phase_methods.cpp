#include "tests/benchmarks/narrow_phase_method.hpp"

namespace enfilade::benchmarks {

std::vector<NarrowPhaseMethod> makeNarrowPhaseMethods() {
  std::vector<NarrowPhaseMethod> all = makeOurNarrowPhases();
  [[maybe_unused]] const auto append = [&all](std::vector<NarrowPhaseMethod> some) {
    for (NarrowPhaseMethod& method : some) all.push_back(std::move(method));
  };
#ifdef BENCH_FCL
  append(makeFclConvexMethods());
#endif
#ifdef BENCH_BULLET
  append(makeBulletConvexMethods());
#endif
#ifdef BENCH_CCD
  append(makeCcdConvexMethods());
#endif
#ifdef BENCH_ODE
  append(makeOdeConvexMethods());
#endif
#ifdef BENCH_CGAL
  append(makeCgalConvexMethods());
#endif
  return all;
}

}  // namespace enfilade::benchmarks
