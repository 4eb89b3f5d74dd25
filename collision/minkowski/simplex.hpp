// Up to four points of a Minkowski difference, and the point of their hull nearest the origin.
// Internal to the narrow phase. Real is double or Wide.
#pragma once

#include "collision/minkowski/minkowski.hpp"

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
  VertexPair newest() const { return pairs[size - 1]; }  ///< faces keep the order of their corners
  void add(const MinkowskiDifference& difference, VertexPair pair);
  /// Exactly these, reduced.
  void set(const MinkowskiDifference& difference, std::span<const VertexPair> to);
  /// Keeps the corners of the face that holds the nearest point, and sets `nearest`.
  void reduce(const MinkowskiDifference& difference);

 private:
  void keepNearestFace(double reach);
};

/// A point of one body: one of its vertices, or where it lies in the body's frame.
struct PointOn {
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  std::uint32_t vertex;  ///< else kNone
  WideVec combined;      ///< where it is no vertex

  WideVec in(const ConvexBody& body) const {
    return vertex == kNone ? combined : WideVec(body.vertices[vertex].cast<Wide>());
  }
};

/// The point of one body that the weights name. It is a point of the body up to the error of a
/// vertex: weights are >= 0, and the greatest (at least 1/4) is made to fill their sum up to 1.
template <class Real>
PointOn combinedPointOn(const Simplex<Real>& simplex, const PlacedBody& placed,
                        std::uint32_t VertexPair::*vertex);
template <class Real>
PointOn pointOn(const Simplex<Real>& simplex, const PlacedBody& placed,
                std::uint32_t VertexPair::*vertex) {
  const std::uint32_t first = simplex.pairs[0].*vertex;
  for (int i = 1; i < simplex.size; ++i)
    if (simplex.pairs[i].*vertex != first) return combinedPointOn(simplex, placed, vertex);
  return {first, {}};
}

template <class Real>
bool Simplex<Real>::holds(VertexPair pair) const {
  for (int i = 0; i < size; ++i)
    if (pairs[i] == pair) return true;
  return false;
}

template <class Real>
void Simplex<Real>::add(const MinkowskiDifference& difference, VertexPair pair) {
  pairs[size] = pair;
  points[size++] = difference.point<Real>(pair);
}

template <class Real>
void Simplex<Real>::set(const MinkowskiDifference& difference, std::span<const VertexPair> to) {
  size = 0;
  for (const VertexPair pair : to) add(difference, pair);
  reduce(difference);
}

template <class Real>
void Simplex<Real>::reduce(const MinkowskiDifference& difference) {
  if (size > 1) return keepNearestFace(difference.reach);
  holdsOrigin = false;
  weight[0] = 1;
  nearest = points[0];
}

extern template struct Simplex<double>;
extern template struct Simplex<Wide>;

}  // namespace enfilade::collision
