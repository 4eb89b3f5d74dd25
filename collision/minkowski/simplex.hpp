// The GJK simplex: up to four points of a Minkowski difference, and the point of their convex hull
// nearest the origin. Internal to the narrow phase. Real is double or LongReal.
#pragma once

#include "collision/assert.hpp"
#include "collision/minkowski/minkowski.hpp"

namespace enfilade::collision {

template <class Real>
struct Simplex {
  using Vec = Eigen::Matrix<Real, 3, 1>;

  std::array<VertexPair, 4> pairs;
  std::array<Vec, 4> points;   ///< of B - A
  std::array<Real, 4> weight;  ///< barycentric, of `nearest`; >= 0, sum 1 up to rounding
  int size = 0;
  Vec nearest;
  bool containsOrigin = false;  ///< certified: the origin is strictly inside; needs four points

  bool contains(VertexPair pair) const;
  VertexPair newest() const { return pairs[size - 1]; }  ///< reduce() keeps the order
  void add(const MinkowskiDifference& difference, VertexPair pair);
  /// Replaces the simplex by these pairs and reduces it.
  void set(const MinkowskiDifference& difference, std::span<const VertexPair> newPairs);
  /// Keeps the corners of the face that contains the nearest point, and sets `nearest`.
  void reduce(const MinkowskiDifference& difference);

 private:
  void keepNearestFace(double reach);
};

/// A point of one body, in the body's frame: a vertex, or a combination of vertices.
struct BodyPoint {
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  std::uint32_t vertex;  ///< kNone if the point is not a vertex
  LongVec3 position;     ///< body's frame, if `vertex` is kNone

  LongVec3 inBodyFrame(const PlacedConvex& convex) const {
    return vertex == kNone ? position : LongVec3(convex.vertices[vertex].cast<LongReal>());
  }
};

/// The point of one body with the simplex' weights. It belongs to the body up to the error of a
/// vertex. The weights are >= 0, and the largest (at least 1/4) is adjusted so that their sum is 1.
template <class Real>
BodyPoint combineVertices(const Simplex<Real>& simplex, const BoundedConvex& convex,
                          std::uint32_t VertexPair::*vertex);
template <class Real>
BodyPoint computeBodyPoint(const Simplex<Real>& simplex, const BoundedConvex& convex,
                           std::uint32_t VertexPair::*vertex) {
  const std::uint32_t first = simplex.pairs[0].*vertex;
  for (int i = 1; i < simplex.size; ++i)
    if (simplex.pairs[i].*vertex != first) return combineVertices(simplex, convex, vertex);
  return {first, {}};
}

template <class Real>
bool Simplex<Real>::contains(VertexPair pair) const {
  for (int i = 0; i < size; ++i)
    if (pairs[i] == pair) return true;
  return false;
}

template <class Real>
void Simplex<Real>::add(const MinkowskiDifference& difference, VertexPair pair) {
  ENFILADE_ASSERT(size >= 0 && size < 4);
  pairs[size] = pair;
  points[size++] = difference.point<Real>(pair);
}

template <class Real>
void Simplex<Real>::set(const MinkowskiDifference& difference,
                        std::span<const VertexPair> newPairs) {
  size = 0;
  for (const VertexPair pair : newPairs) add(difference, pair);
  reduce(difference);
}

template <class Real>
void Simplex<Real>::reduce(const MinkowskiDifference& difference) {
  if (size > 1) return keepNearestFace(difference.reach);
  containsOrigin = false;
  weight[0] = 1;
  nearest = points[0];
}

extern template struct Simplex<double>;
extern template struct Simplex<LongReal>;

}  // namespace enfilade::collision
