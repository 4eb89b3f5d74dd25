// Instruction sets of the processor, for dispatch at run time. Every path gives the same bits.
#pragma once

namespace enfilade::collision {

inline bool hasAvx() {
#if defined(__x86_64__)
  return __builtin_cpu_supports("avx") != 0;
#else
  return false;
#endif
}

}  // namespace enfilade::collision
