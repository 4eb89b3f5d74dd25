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

extern template struct Simplex<double>;
extern template struct Simplex<Wide>;

}  // namespace enfilade::collision
