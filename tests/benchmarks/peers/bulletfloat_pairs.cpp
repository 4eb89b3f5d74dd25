// Peer: Bullet in floats. Its libraries have the names of those in doubles, so they are loaded with
// a module whose symbols no other part of the program sees.
#include <dlfcn.h>

#include <stdexcept>

#include "tests/benchmarks/broad_phase_method.hpp"

namespace enfilade::benchmarks {

std::vector<BroadPhaseMethod> makeFloatBulletBroadPhases() {
  void* module = dlopen(BENCH_BULLET_FLOAT_MODULE, RTLD_NOW | RTLD_LOCAL | RTLD_DEEPBIND);
  if (!module) throw std::runtime_error(dlerror());
  using Make = std::vector<BroadPhaseMethod>*();
  const auto make = reinterpret_cast<Make*>(dlsym(module, "makeBulletFloatBroadPhases"));
  if (!make) throw std::runtime_error(dlerror());
  const std::unique_ptr<std::vector<BroadPhaseMethod>> methods(make());
  return std::move(*methods);
}

}  // namespace enfilade::benchmarks
