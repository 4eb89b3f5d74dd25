// Step 2 at the head of narrow_phase.cpp. GJK terminates because |nearest| decreases at every step
// except a bounded number of equal ones.
#include "collision/narrow_phase/gjk.hpp"

#include "collision/assert.hpp"

namespace enfilade::collision {
namespace {

constexpr int kMaxEqualSteps = 4;   // GJK steps that do not decrease the distance
constexpr int kMaxIterations = 96;  // about 10 are typical; at the limit, the next step takes over

/// The point of B - A with the smallest projection on state.direction, up to rounding, or a point
/// beyond the origin.
template <class Real>
struct GjkSupport {
  VertexPair pair;
  Real along;  ///< projection, times state.length
};

/// `local`: a climb stops at a vertex that alone moves the support beyond the origin. The direction
/// is then no separating axis, and a close vertex improves the simplex more than a distant one.
GjkSupport<double> findSupport(const MinkowskiDifference& difference, bool local, double limit,
                               GjkState<double>& state) {
  const double enough =
      local ? state.length * state.length : std::numeric_limits<double>::infinity();
  hillClimbPair(difference, state.direction, state.length, state.simplex.newest(), enough,
                state.supports);
  const SupportValue value =
      computeSupportValue(difference, state.direction, state.length, state.supports);
  state.beyondLimit = value.bound > limit * state.length * kMaxUnitLength;
  return {state.supports.pair(), value.value};
}
GjkSupport<LongReal> findSupport(const MinkowskiDifference& difference, bool, double limit,
                                 GjkState<LongReal>& state) {
  VertexPair hint = state.simplex.newest();
  const CertifiedSupport support =
      findCertifiedSupport(difference, state.direction, state.length, hint);
  state.lowerBound =
      std::max(state.lowerBound, support.lowerBound / state.length * (1 - 4 * kLongRoundoff));
  state.beyondLimit = state.lowerBound > limit;
  return {support.pair, support.projection};
}

}  // namespace

bool isUsable(const FeatureCache& cache, const PlacedConvex& a, const PlacedConvex& b) {
  if (cache.size < 1 || cache.size > 4) return false;
  for (int i = 0; i < cache.size; ++i)
    if (cache.pairs[i].a >= a.vertices.size() || cache.pairs[i].b >= b.vertices.size())
      return false;
  return true;
}

template <class Real>
bool warmStart(const MinkowskiDifference& difference, const FeatureCache& cache,
               GjkState<Real>& state) {
  const bool warm = isUsable(cache, *difference.a.shape, *difference.b.shape);
  if (warm) {
    const std::span pairs(cache.pairs);
    state.simplex.set(difference, pairs.first(static_cast<std::size_t>(cache.size)));
  } else {
    state.simplex.set(difference, std::array{VertexPair{}});
  }
  state.distance = computeNorm(state.simplex.nearest);
  return warm;
}

template <class Real>
void iterateGjk(const MinkowskiDifference& difference, double limit, int localSteps,
                GjkState<Real>& state) {
  const Real tolerance = 24 * getUnitRoundoff<Real>() * static_cast<Real>(difference.reach);
  Simplex<Real>& simplex = state.simplex;
  int equalSteps = 0;
  for (int i = 0; i < kMaxIterations && state.hasDirection(); ++i) {
    state.direction = simplex.nearest;
    state.length = state.distance * kLengthInflation<Real>;
    const GjkSupport<Real> support = findSupport(difference, i < localSteps, limit, state);
    if (state.beyondLimit ||
        state.distance * state.distance - support.along <= tolerance * state.length ||
        simplex.contains(support.pair))
      return;
    ENFILADE_ASSERT(simplex.size < 4);  // four points contain the origin and end the loop
    const std::array<VertexPair, 4> lastPairs = simplex.pairs;
    const int lastSize = simplex.size;
    simplex.add(difference, support.pair);
    simplex.reduce(difference);
    const Real distance = computeNorm(simplex.nearest);
    if (!simplex.containsOrigin && !(distance < state.distance)) {
      // An equal distance may still help: its direction may certify the features.
      const bool asNear = distance <= state.distance && simplex.contains(support.pair);
      if (!asNear || ++equalSteps > kMaxEqualSteps) {
        // Restores the last simplex bit for bit: reducing a reduced face changes nothing.
        simplex.set(difference, std::span(lastPairs).first(static_cast<std::size_t>(lastSize)));
        return;
      }
    }
    state.distance = distance;
  }
}

template bool warmStart(const MinkowskiDifference&, const FeatureCache&, GjkState<double>&);
template bool warmStart(const MinkowskiDifference&, const FeatureCache&, GjkState<LongReal>&);
template void iterateGjk(const MinkowskiDifference&, double, int, GjkState<double>&);
template void iterateGjk(const MinkowskiDifference&, double, int, GjkState<LongReal>&);

}  // namespace enfilade::collision
