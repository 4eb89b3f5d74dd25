// Two doubles in one register, as gcc and clang vector types, which exist on every processor. A
// comparison gives -1 for true and 0 for false.
#pragma once

#include <cstring>
#ifdef __SSE2__
#include <emmintrin.h>
#endif

namespace enfilade::collision {

using Double2 = double __attribute__((vector_size(16)));
using Mask2 = long long __attribute__((vector_size(16)));

inline Double2 loadDouble2(const double* from) {
  Double2 lanes;
  std::memcpy(&lanes, from, sizeof(lanes));
  return lanes;
}

/// One bit per lane, for the mask of a single comparison: gcc 12 splits combined masks into lanes.
inline unsigned toBits(Mask2 mask) {
#ifdef __SSE2__
  return static_cast<unsigned>(__builtin_ia32_movmskpd(reinterpret_cast<Double2>(mask)));
#else
  return static_cast<unsigned>((mask[0] & 1) | (mask[1] & 2));
#endif
}

/// Whether three masks have no lane set.
inline bool isNoneSet(Mask2 a, Mask2 b, Mask2 c) {
#ifdef __SSE2__
  const auto lanes = [](Mask2 mask) { return reinterpret_cast<__m128d>(mask); };
  return _mm_movemask_pd(_mm_or_pd(_mm_or_pd(lanes(a), lanes(b)), lanes(c))) == 0;
#else
  return (toBits(a) | toBits(b) | toBits(c)) == 0;
#endif
}

}  // namespace enfilade::collision
