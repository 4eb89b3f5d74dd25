#include "tests/benchmarks/mesh_method.hpp"

namespace enfilade::benchmarks {

std::vector<MeshMethod> meshMethods() {
  std::vector<MeshMethod> all = ourMeshQueries();
  [[maybe_unused]] const auto append = [&all](std::vector<MeshMethod> some) {
    for (MeshMethod& method : some) all.push_back(std::move(method));
  };
#ifdef BENCH_FCL
  append(fclMesh());
#endif
#ifdef BENCH_BULLET
  append(bulletMesh());
#endif
  return all;
}

}  // namespace enfilade::benchmarks
