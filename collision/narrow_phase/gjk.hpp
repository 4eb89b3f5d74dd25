// GJK on the Minkowski difference of two convex bodies. Internal to the narrow phase. Real is
// double or LongReal.
#pragma once

#include "collision/minkowski/simplex.hpp"

namespace enfilade::collision {

inline constexpr double kMinDoubleDistance = 1e-140;  // metres: below, a squared length loses bits

/// Factor that turns a rounded length into an upper bound of the length.
template <class Real>
constexpr Real kLengthInflation = 1 + 16 * getUnitRoundoff<Real>();

/// The state of GJK, in Real.
template <class Real>
struct GjkState {
  using Vec = Eigen::Matrix<Real, 3, 1>;

  Simplex<Real> simplex;
  Real distance = 0;            ///< |simplex.nearest|, metres
  Vec direction = Vec::Zero();  ///< of the last support: simplex.nearest at that step
  Real length = 0;              ///< upper bound on |direction|
  SupportPair supports;         ///< of the last support; doubles only
  LongReal lowerBound = 0;      ///< certified bound of the distance; extended precision only
  bool beyondLimit = false;     ///< certified: the distance exceeds the limit

  /// `direction`, unit up to rounding.
  Vec3 axis() const {
    return scaleVector(direction, kLengthInflation<Real> / length).template cast<double>();
  }
  /// False: the simplex contains the origin, or nearly touches it.
  bool hasDirection() const {
    constexpr bool isDouble = std::is_same_v<Real, double>;
    return !simplex.containsOrigin &&
           distance > (isDouble ? kMinDoubleDistance : std::numeric_limits<double>::min());
  }
};

/// True if the cached features exist in both bodies.
bool isUsable(const FeatureCache& cache, const PlacedConvex& a, const PlacedConvex& b);

/// Starts from the cached features if they are valid, otherwise from any point. True: warm start.
template <class Real>
bool warmStart(const MinkowskiDifference& difference, const FeatureCache& cache,
               GjkState<Real>& state);

/// Iterates until the simplex is the closest features or a tetrahedron that contains the origin. It
/// also ends if the distance is certified to exceed `limit`, or if Real makes no more progress. In
/// the first `localSteps` steps, climbs stop once they pass the origin.
template <class Real>
void iterateGjk(const MinkowskiDifference& difference, double limit, int localSteps,
                GjkState<Real>& state);

template <class Real>
void storeFeatures(const GjkState<Real>& state, FeatureCache& cache) {
  cache.size = state.simplex.size;
  for (int i = 0; i < state.simplex.size; ++i) cache.pairs[i] = state.simplex.pairs[i];
}

extern template bool warmStart(const MinkowskiDifference&, const FeatureCache&, GjkState<double>&);
extern template bool warmStart(const MinkowskiDifference&, const FeatureCache&,
                               GjkState<LongReal>&);
extern template void iterateGjk(const MinkowskiDifference&, double, int, GjkState<double>&);
extern template void iterateGjk(const MinkowskiDifference&, double, int, GjkState<LongReal>&);

}  // namespace enfilade::collision
