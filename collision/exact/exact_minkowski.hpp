// The Minkowski difference B - A of two convex bodies in exact integers: slow, and right for every
// input. Internal to the narrow phase.
#pragma once

#include <gmpxx.h>

#include <optional>
#include <vector>

#include "collision/minkowski/minkowski.hpp"

namespace enfilade::collision {

using Integer = mpz_class;

struct ExactPoint {
  Integer x, y, z;
};

ExactPoint operator+(const ExactPoint& a, const ExactPoint& b);
ExactPoint operator-(const ExactPoint& a, const ExactPoint& b);
ExactPoint operator*(const Integer& s, const ExactPoint& a);
Integer dot(const ExactPoint& a, const ExactPoint& b);
ExactPoint cross(const ExactPoint& a, const ExactPoint& b);
bool isZero(const ExactPoint& a);

/// Both bodies' vertices in the world's frame, in integer multiples of 2^scale metres; made when
/// first asked for.
class ExactDifference {
 public:
  ExactDifference(const ConvexBody& a, const ConvexBody& b);

  const ExactPoint& pointA(std::uint32_t i) { return a_.vertex(i, scale_); }
  const ExactPoint& pointB(std::uint32_t i) { return b_.vertex(i, scale_); }
  ExactPoint operator()(VertexPair pair) { return pointB(pair.b) - pointA(pair.a); }
  /// The pair least along `direction` (not zero), exactly; `hint` as in minkowski.hpp.
  VertexPair leastAlong(const ExactPoint& direction, VertexPair& hint);
  int scale() const { return scale_; }

 private:
  struct Body {
    const ConvexBody* placed;
    PlacedBody bounds;
    int rotationScale = 0, vertexScale = 0, translationScale = 0;
    std::vector<Integer> rotation;  ///< nine, row by row; empty: none
    std::vector<std::optional<ExactPoint>> vertices;

    explicit Body(const ConvexBody& body);
    int scale() const;
    const ExactPoint& vertex(std::uint32_t i, int scale);
  };
  Body a_, b_;
  int scale_;
};

/// A face of a simplex and the point of it nearest the origin: the sum of weight * point / total.
struct ExactFace {
  std::vector<int> corners;
  std::vector<Integer> weights;  ///< all > 0
  Integer total;                 ///< the sum of the weights
  ExactPoint direction;  ///< along the nearest point, some positive length; zero: it is the origin
};

/// The face of the hull of one to four points that holds the hull's point nearest the origin.
ExactFace nearestFace(const std::vector<ExactPoint>& points);

/// The features of B - A nearest the origin.
struct ExactNearest {
  std::vector<VertexPair> pairs;
  ExactFace face;  ///< all of `pairs` are its corners
};

/// GJK in integers: the nearest point falls strictly, and there are finitely many faces, so it
/// ends. `cache` is where to start, and holds the features afterwards.
ExactNearest nearestExactly(ExactDifference& difference, const FeatureCache& cache);

/// For features that hold the origin: a direction along which no point of B - A is negative, if
/// there is one (the bodies touch); none when the origin is inside (they penetrate).
std::optional<ExactPoint> partingDirection(ExactDifference& difference,
                                           const ExactNearest& nearest);

/// The nearest point itself, times face.total.
ExactPoint weightedSum(ExactDifference& difference, const ExactNearest& nearest);

/// `value` times 2^scale, rounded to the nearest double.
double toDouble(const mpf_class& value, int scale);
/// The same, and what that leaves, rounded: an unevaluated sum.
void roundInTwo(const mpf_class& value, int scale, double& head, double& tail);
/// The sum of weight * point / total over one body, in metres: near to 2^-190, relative.
std::array<mpf_class, 3> weightedPoint(ExactDifference& difference, const ExactNearest& nearest,
                                       bool ofA);
mpf_class precise(const Integer& value);
/// Unit, rounded.
Vec3 unitVector(const ExactPoint& direction);

}  // namespace enfilade::collision
