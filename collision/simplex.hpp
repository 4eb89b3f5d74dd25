// Up to four points of a Minkowski difference, and the point of their hull nearest the origin.
// Internal to the narrow phase. Real is double or Wide.
#pragma once

#include "collision/minkowski.hpp"

namespace enfilade::collision {

template <class Real>
struct Simplex {
  using Vec = Eigen::Matrix<Real, 3, 1>;

  std::array<VertexPair, 4> pairs;
  std::array<Vec, 4> points;   ///< of B - A
  std::array<Real, 4> weight;  ///< of the nearest point; >= 0, their sum is 1 up to rounding
  int size = 0;
  Vec nearest;
  bool holdsOrigin = false;  ///< proved: strictly inside; only with four points

  bool holds(VertexPair pair) const;
  void add(const MinkowskiDifference& difference, VertexPair pair);
  /// Keeps the corners of the face that holds the nearest point, and sets `nearest`.
  void reduce(const MinkowskiDifference& difference);
};

/// The point of one body that the weights name, turned: world axes, from the body's translation. It
/// is a point of the body up to the error of a vertex: weights are >= 0, and the greatest (at least
/// 1/4) is made to fill their sum up to 1.
template <class Real>
WideVec pointOn(const Simplex<Real>& simplex, const PlacedBody& placed,
                std::uint32_t VertexPair::*vertex);

extern template struct Simplex<double>;
extern template struct Simplex<Wide>;

}  // namespace enfilade::collision
