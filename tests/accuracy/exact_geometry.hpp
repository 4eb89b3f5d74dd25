// Exact reference for two convex bodies: slow and simple, without code from collision/.
// World vertices are dyadic rationals, so one power of two makes all of them integers.
#pragma once

#include <gmpxx.h>

#include <optional>
#include <string>
#include <vector>

#include "collision/types.hpp"

namespace enfilade::accuracy {

using collision::Mat3;
using collision::Vec3;

/// A vertex list at a pose: world = rotation * vertex + translation, exactly.
struct Placed {
  std::vector<Vec3> points;
  Mat3 rotation = Mat3::Identity();
  Vec3 translation = Vec3::Zero();
};

struct IntegerPoint {
  mpz_class x, y, z;
};

/// Both bodies' world vertices, and two points of the world, each times 2^bits.
struct ExactPair {
  std::vector<IntegerPoint> a, b;
  IntegerPoint pointA, pointB;
  long bits = 0;
};

ExactPair makeExactPair(const Placed& a, const Placed& b, const Vec3& pointA = Vec3::Zero(),
                        const Vec3& pointB = Vec3::Zero());

/// The point numerator / denominator of a convex hull that is nearest the origin. The result is
/// checked: it is a convex combination, and no point of the hull has a smaller projection on it.
struct NearestPoint {
  IntegerPoint numerator;
  mpz_class denominator;  ///< > 0
};

/// Finds the nearest point of the Minkowski difference of two lists, {y - x : x in a, y in b}.
NearestPoint findNearestOfDifference(const std::vector<IntegerPoint>& a,
                                     const std::vector<IntegerPoint>& b);

/// Length of a nearest point, in metres, as a number of 512 bits.
mpf_class computeLength(const NearestPoint& nearest, long bits);

/// Whether `point` lies within `tolerance` (metres) of the hull of `body`: exact.
bool isWithinTolerance(const IntegerPoint& point, const std::vector<IntegerPoint>& body, long bits,
                       double tolerance);

enum class ReferenceVerdict { separated, touching, penetrating };

/// The exact answer by exhaustive search over all candidate normals of the Minkowski difference.
/// The cost grows with the fourth power of the vertex count: for small bodies only.
struct ReferenceResult {
  ReferenceVerdict verdict = ReferenceVerdict::separated;
  mpf_class distance;  ///< metres; 0 unless separated
  mpf_class depth;     ///< metres; 0 unless penetrating
};

ReferenceResult computeReferenceResult(const ExactPair& pair);

/// A number of 512 bits, from a decimal string or exactly from a double.
mpf_class toPreciseNumber(const std::string& decimal);
mpf_class toPreciseNumber(double value);

/// |p - q| in metres.
mpf_class computeDistance(const Vec3& p, const Vec3& q);

}  // namespace enfilade::accuracy
