#include "tests/benchmarks/mesh_method.hpp"

namespace enfilade::benchmarks {

std::vector<MeshMethod> makeMeshMethods() {
  std::vector<MeshMethod> all = makeOurMeshQueries();
  [[maybe_unused]] const auto append = [&all](std::vector<MeshMethod> some) {
    for (MeshMethod& method : some) all.push_back(std::move(method));
  };
#ifdef BENCH_FCL
  append(makeFclMeshMethods());
#endif
#ifdef BENCH_BULLET
  append(makeBulletMeshMethods());
#endif
  return all;
}

}  // namespace enfilade::benchmarks
