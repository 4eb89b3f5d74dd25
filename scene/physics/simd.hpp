// Doubles side by side, one of each of a few things that do not touch one another: what is done to
// them is done to all at once, and to each as if it were alone, to the last bit. In a form that gcc
// and clang know on every processor.
//
// Four doubles fill a register of AVX. The whole program is made for processors without it, so a
// loop over lanes is compiled twice, and who runs it takes the one that the processor knows: see
// forEach(). What a loop calls has to be inlined into it, since the other's registers are not its.
#pragma once

#include <cmath>
#include <cstddef>
#include <span>

#include "collision/types.hpp"

namespace enfilade::scene {

using collision::Vec3;

inline constexpr std::size_t kLanes = 4;

/// Of a pack; gcc takes half of it where it does not know the register, and all of it where it
/// does.
inline constexpr std::size_t kLaneAlignment = kLanes * sizeof(double);

/// Which of the lanes: -1 where it holds.
struct alignas(kLaneAlignment) LaneMask {
  using Pack = long long __attribute__((vector_size(kLaneAlignment)));
  Pack pack;
};

struct alignas(kLaneAlignment) Lanes {
  using Pack = double __attribute__((vector_size(kLaneAlignment)));
  Pack pack;  // not set: rows of them are filled by who needs them

  double operator[](std::size_t lane) const { return pack[lane]; }
  void put(std::size_t lane, double value) { pack[lane] = value; }
};

[[gnu::always_inline]] inline Lanes everywhere(double value) {
  return {Lanes::Pack{value, value, value, value}};
}

[[gnu::always_inline]] inline Lanes operator+(const Lanes& a, const Lanes& b) {
  return {a.pack + b.pack};
}
[[gnu::always_inline]] inline Lanes operator-(const Lanes& a, const Lanes& b) {
  return {a.pack - b.pack};
}
[[gnu::always_inline]] inline Lanes operator*(const Lanes& a, const Lanes& b) {
  return {a.pack * b.pack};
}
[[gnu::always_inline]] inline Lanes operator/(const Lanes& a, const Lanes& b) {
  return {a.pack / b.pack};
}
[[gnu::always_inline]] inline Lanes operator-(const Lanes& a) {
  return {-a.pack};
}
[[gnu::always_inline]] inline LaneMask operator<(const Lanes& a, const Lanes& b) {
  return {a.pack < b.pack};
}

[[gnu::always_inline]] inline Lanes choose(const LaneMask& where, const Lanes& there,
                                           const Lanes& elsewhere) {
  return {where.pack ? there.pack : elsewhere.pack};
}
[[gnu::always_inline]] inline bool any(const LaneMask& mask) {
  return ((mask.pack[0] | mask.pack[1]) | (mask.pack[2] | mask.pack[3])) != 0;
}
[[gnu::always_inline]] inline Lanes lesser(const Lanes& a, const Lanes& b) {
  return choose(b < a, b, a);
}
[[gnu::always_inline]] inline Lanes greater(const Lanes& a, const Lanes& b) {
  return choose(a < b, b, a);
}
[[gnu::always_inline]] inline Lanes clamped(const Lanes& value, const Lanes& least,
                                            const Lanes& most) {
  return choose(value < least, least, choose(most < value, most, value));
}
[[gnu::always_inline]] inline Lanes squareRoot(const Lanes& a) {
  return {Lanes::Pack{std::sqrt(a[0]), std::sqrt(a[1]), std::sqrt(a[2]), std::sqrt(a[3])}};
}

struct Lanes3 {
  Lanes x, y, z;

  Vec3 at(std::size_t lane) const { return {x[lane], y[lane], z[lane]}; }
  void put(std::size_t lane, const Vec3& v) {
    x.put(lane, v.x()), y.put(lane, v.y()), z.put(lane, v.z());
  }
};

[[gnu::always_inline]] inline Lanes3 sideBySide(const Vec3& a, const Vec3& b, const Vec3& c,
                                                const Vec3& d) {
  return {{Lanes::Pack{a.x(), b.x(), c.x(), d.x()}},
          {Lanes::Pack{a.y(), b.y(), c.y(), d.y()}},
          {Lanes::Pack{a.z(), b.z(), c.z(), d.z()}}};
}
[[gnu::always_inline]] inline Lanes3 operator+(const Lanes3& a, const Lanes3& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
[[gnu::always_inline]] inline Lanes3 operator-(const Lanes3& a, const Lanes3& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
[[gnu::always_inline]] inline Lanes3 operator*(const Lanes& factor, const Lanes3& v) {
  return {factor * v.x, factor * v.y, factor * v.z};
}
[[gnu::always_inline]] inline Lanes dot(const Lanes3& a, const Lanes3& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

// ---- loops -------------------------------------------------------------------------------------

#if defined(__x86_64__)
template <class Item, class Each>
__attribute__((target("avx"))) void forEachByAvx(std::span<Item> items, const Each& each) {
  for (Item& item : items) each(item);
}
inline bool hasAvx() {
  return __builtin_cpu_supports("avx") != 0;
}
#else
template <class Item, class Each>
void forEachByAvx(std::span<Item> items, const Each& each) {
  for (Item& item : items) each(item);
}
inline bool hasAvx() {
  return false;
}
#endif

/// Calls each(item) for all, in their order; `each` and all that it calls is to be always inlined.
/// `byAvx`: the processor has it; the result is the same.
template <class Item, class Each>
void forEach(std::span<Item> items, bool byAvx, const Each& each) {
  if (byAvx) return forEachByAvx(items, each);
  for (Item& item : items) each(item);
}

}  // namespace enfilade::scene
