#include "tests/benchmarks/narrow_phase_method.hpp"

namespace enfilade::benchmarks {

std::vector<NarrowPhaseMethod> narrowPhaseMethods() {
  std::vector<NarrowPhaseMethod> all = ourNarrowPhases();
  [[maybe_unused]] const auto append = [&all](std::vector<NarrowPhaseMethod> some) {
    for (NarrowPhaseMethod& method : some) all.push_back(std::move(method));
  };
#ifdef BENCH_FCL
  append(fclConvex());
#endif
#ifdef BENCH_BULLET
  append(bulletConvex());
#endif
#ifdef BENCH_CCD
  append(ccdConvex());
#endif
#ifdef BENCH_ODE
  append(odeConvex());
#endif
#ifdef BENCH_CGAL
  append(cgalConvex());
#endif
  return all;
}

}  // namespace enfilade::benchmarks
