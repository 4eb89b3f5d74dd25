// Four-wide double SIMD, as vector extensions of gcc and clang. Lanes are independent; results
// equal scalar code bit for bit.
//
// Four doubles fill an AVX register. The program is compiled for processors without AVX, so each
// loop is compiled twice and selected at run time; see runSimdLoop(). Functions that a loop calls
// must be inlined into it, because the two versions use different registers.
#pragma once

#include <cmath>
#include <cstddef>
#include <span>

#include "collision/types.hpp"

namespace enfilade::scene {

using collision::Vec3;

inline constexpr std::size_t kLanes = 4;

/// Alignment of a pack in bytes. gcc splits a pack in two where it has no AVX registers.
inline constexpr std::size_t kLaneAlignment = kLanes * sizeof(double);

/// Lane mask: -1 where the condition holds.
struct alignas(kLaneAlignment) MaskW {
  using Pack = long long __attribute__((vector_size(kLaneAlignment)));
  Pack pack;
};

struct alignas(kLaneAlignment) DoubleW {
  using Pack = double __attribute__((vector_size(kLaneAlignment)));
  Pack pack;  // not initialised: rows are filled by their users

  double operator[](std::size_t lane) const { return pack[lane]; }
  void set(std::size_t lane, double value) { pack[lane] = value; }
};

[[gnu::always_inline]] inline DoubleW splat(double value) {
  return {DoubleW::Pack{value, value, value, value}};
}

[[gnu::always_inline]] inline DoubleW operator+(const DoubleW& a, const DoubleW& b) {
  return {a.pack + b.pack};
}
[[gnu::always_inline]] inline DoubleW operator-(const DoubleW& a, const DoubleW& b) {
  return {a.pack - b.pack};
}
[[gnu::always_inline]] inline DoubleW operator*(const DoubleW& a, const DoubleW& b) {
  return {a.pack * b.pack};
}
[[gnu::always_inline]] inline DoubleW operator/(const DoubleW& a, const DoubleW& b) {
  return {a.pack / b.pack};
}
[[gnu::always_inline]] inline DoubleW operator-(const DoubleW& a) {
  return {-a.pack};
}
[[gnu::always_inline]] inline MaskW operator<(const DoubleW& a, const DoubleW& b) {
  return {a.pack < b.pack};
}

[[gnu::always_inline]] inline DoubleW selectW(const MaskW& mask, const DoubleW& ifTrue,
                                              const DoubleW& ifFalse) {
  return {mask.pack ? ifTrue.pack : ifFalse.pack};
}
[[gnu::always_inline]] inline bool any(const MaskW& mask) {
  return ((mask.pack[0] | mask.pack[1]) | (mask.pack[2] | mask.pack[3])) != 0;
}
[[gnu::always_inline]] inline DoubleW minW(const DoubleW& a, const DoubleW& b) {
  return selectW(b < a, b, a);
}
[[gnu::always_inline]] inline DoubleW maxW(const DoubleW& a, const DoubleW& b) {
  return selectW(a < b, b, a);
}
[[gnu::always_inline]] inline DoubleW clampW(const DoubleW& value, const DoubleW& lower,
                                             const DoubleW& upper) {
  return selectW(value < lower, lower, selectW(upper < value, upper, value));
}
[[gnu::always_inline]] inline DoubleW sqrtW(const DoubleW& a) {
  return {DoubleW::Pack{std::sqrt(a[0]), std::sqrt(a[1]), std::sqrt(a[2]), std::sqrt(a[3])}};
}

struct Vec3W {
  DoubleW x, y, z;

  Vec3 at(std::size_t lane) const { return {x[lane], y[lane], z[lane]}; }
  void set(std::size_t lane, const Vec3& v) {
    x.set(lane, v.x()), y.set(lane, v.y()), z.set(lane, v.z());
  }
};

[[gnu::always_inline]] inline Vec3W gather(const Vec3& a, const Vec3& b, const Vec3& c,
                                           const Vec3& d) {
  return {{DoubleW::Pack{a.x(), b.x(), c.x(), d.x()}},
          {DoubleW::Pack{a.y(), b.y(), c.y(), d.y()}},
          {DoubleW::Pack{a.z(), b.z(), c.z(), d.z()}}};
}
[[gnu::always_inline]] inline Vec3W operator+(const Vec3W& a, const Vec3W& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
[[gnu::always_inline]] inline Vec3W operator-(const Vec3W& a, const Vec3W& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
[[gnu::always_inline]] inline Vec3W operator*(const DoubleW& factor, const Vec3W& v) {
  return {factor * v.x, factor * v.y, factor * v.z};
}
[[gnu::always_inline]] inline DoubleW dot(const Vec3W& a, const Vec3W& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

// ---- loops -------------------------------------------------------------------------------------

#if defined(__x86_64__)
template <class Item, class Each>
__attribute__((target("avx"))) void runAvxLoop(std::span<Item> items, const Each& each) {
  for (Item& item : items) each(item);
}
#else
template <class Item, class Each>
void runAvxLoop(std::span<Item> items, const Each& each) {
  for (Item& item : items) each(item);
}
#endif

/// Calls each(item) for all items in order. `each` and all that it calls must be always_inline.
/// `useAvx`: the processor has AVX; the result is the same.
template <class Item, class Each>
void runSimdLoop(std::span<Item> items, bool useAvx, const Each& each) {
  if (useAvx) return runAvxLoop(items, each);
  for (Item& item : items) each(item);
}

}  // namespace enfilade::scene
