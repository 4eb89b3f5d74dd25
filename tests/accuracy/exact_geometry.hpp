// The judge: exact answers on two convex bodies, slow and simple, sharing no code with collision/.
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

/// A list of vertices and its place: world = rotation * vertex + translation, exactly.
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

ExactPair exactPair(const Placed& a, const Placed& b, const Vec3& pointA = Vec3::Zero(),
                    const Vec3& pointB = Vec3::Zero());

/// The point numerator / denominator of a convex hull that is nearest the origin. Its own proof:
/// it is a convex combination, and no point of the hull lies less far along it (checked).
struct NearestPoint {
  IntegerPoint numerator;
  mpz_class denominator;  ///< > 0
};

/// Of the Minkowski difference of two lists, {y - x : x in a, y in b}.
NearestPoint nearestOfDifference(const std::vector<IntegerPoint>& a,
                                 const std::vector<IntegerPoint>& b);

/// Length of a nearest point, in metres, as a number of 512 bits.
mpf_class lengthOf(const NearestPoint& nearest, long bits);

/// Whether `point` lies within `tolerance` (metres) of the hull of `body`: exact.
bool liesWithin(const IntegerPoint& point, const std::vector<IntegerPoint>& body, long bits,
                double tolerance);

enum class TrueVerdict { separated, touching, penetrating };

/// By all features: every candidate for the normal of a face of the Minkowski difference. The cost
/// grows with the fourth power of the vertices: for small bodies.
struct TrueAnswer {
  TrueVerdict verdict = TrueVerdict::separated;
  mpf_class distance;  ///< metres; 0 unless separated
  mpf_class depth;     ///< metres; 0 unless penetrating
};

TrueAnswer trueAnswer(const ExactPair& pair);

/// A number of 512 bits, from a decimal string or exactly from a double.
mpf_class preciseNumber(const std::string& decimal);
mpf_class preciseNumber(double value);

/// |p - q| in metres.
mpf_class distanceOf(const Vec3& p, const Vec3& q);

}  // namespace enfilade::accuracy
