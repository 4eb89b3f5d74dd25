// Up to four points of a Minkowski difference, and the point of their hull nearest the origin.
// Internal to the narrow phase.
#pragma once

#include "collision/minkowski.hpp"

namespace enfilade::collision {

struct Simplex {
  struct Corner {
    VertexPair pair;
    WideVec onA, onB;  ///< world axes, from t_A
    WideVec w;         ///< onB - onA
    Wide weight = 1;   ///< of the nearest point; >= 0, the weights sum up to 1
  };
  std::array<Corner, 4> corners;
  int size = 0;
  WideVec nearest = WideVec::Zero();
  bool holdsOrigin = false;  ///< proved: strictly inside; only with four corners

  bool holds(VertexPair pair) const;
  void add(const MinkowskiDifference& difference, VertexPair pair);
  /// Keeps the corners of the face that holds the nearest point, and sets `nearest`.
  void reduce(const MinkowskiDifference& difference);
  WideVec pointOnA() const;
  WideVec pointOnB() const;
};

}  // namespace enfilade::collision
