// The Minkowski difference B - A of two convex bodies in exact integers: slow, but correct for
// every input. Internal to collision/.
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

/// The Minkowski difference B - A in integer multiples of 2^scale metres, world axes. Vertices are
/// computed on first use.
class ExactMinkowskiDifference {
 public:
  ExactMinkowskiDifference(const PlacedConvex& a, const PlacedConvex& b);

  const ExactPoint& pointA(std::uint32_t i) { return a_.vertex(i, scale_); }
  const ExactPoint& pointB(std::uint32_t i) { return b_.vertex(i, scale_); }
  ExactPoint operator()(VertexPair pair) { return pointB(pair.b) - pointA(pair.a); }
  /// Finds the exact support pair of B - A against `direction` (not zero); `hint` as in
  /// minkowski.hpp.
  VertexPair findSupport(const ExactPoint& direction, VertexPair& hint);
  int scale() const { return scale_; }

 private:
  struct ExactConvex {
    const PlacedConvex* shape;
    BoundedConvex bounds;
    int rotationScale = 0, vertexScale = 0, translationScale = 0;
    std::vector<Integer> rotation;  ///< nine, row by row; empty: identity
    std::vector<std::optional<ExactPoint>> vertices;

    explicit ExactConvex(const PlacedConvex& placedConvex);
    int scale() const;
    const ExactPoint& vertex(std::uint32_t i, int scale);
  };
  ExactConvex a_, b_;
  int scale_;
};

/// A face of a simplex and its point nearest the origin, the sum of weight * point / total.
struct ExactFace {
  std::vector<int> corners;
  std::vector<Integer> weights;  ///< all > 0
  Integer total;                 ///< the sum of the weights
  ExactPoint direction;  ///< along the nearest point, any length; zero: the point is the origin
};

/// Finds the face of the hull of one to four points that contains its point nearest the origin.
ExactFace findNearestFace(const std::vector<ExactPoint>& points);

/// The features of B - A nearest the origin.
struct ExactNearestFeature {
  std::vector<VertexPair> pairs;
  ExactFace face;  ///< its corners are all of `pairs`
};

/// GJK in integers. It terminates because the nearest point gets strictly nearer and there are
/// finitely many faces. `cache` is the warm start.
ExactNearestFeature findNearestExactly(ExactMinkowskiDifference& difference,
                                       const FeatureCache& cache);

/// For features that contain the origin: finds a direction on which no point of B - A has a
/// negative projection (the bodies touch). nullopt if the origin is inside B - A (they penetrate).
std::optional<ExactPoint> findSeparatingDirection(ExactMinkowskiDifference& difference,
                                                  const ExactNearestFeature& nearest);

/// The nearest point, times face.total.
ExactPoint computeWeightedSum(ExactMinkowskiDifference& difference,
                              const ExactNearestFeature& nearest);

/// `value` times 2^scale, rounded to the nearest double.
double toDouble(const mpf_class& value, int scale);
/// The same as an unevaluated sum: `head` rounded, and `tail` the rounded remainder.
void splitToDoubles(const mpf_class& value, int scale, double& head, double& tail);
/// The sum of weight * point / total over one body, in units of 2^scale metres; relative error
/// about 2^-190.
std::array<mpf_class, 3> computeWeightedPoint(ExactMinkowskiDifference& difference,
                                              const ExactNearestFeature& nearest, bool ofA);
/// `value` as a float of 256 bits.
mpf_class toPreciseFloat(const Integer& value);
/// The unit vector along `direction`, rounded.
Vec3 toUnitVector(const ExactPoint& direction);

}  // namespace enfilade::collision
