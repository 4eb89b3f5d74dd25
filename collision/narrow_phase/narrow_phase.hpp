// Narrow phase: the exact verdict on two convex polytopes, their distance in doubles with a
// certified error bound, and witness points. The tick uses it; refine.hpp has exact numbers.
#pragma once

#include <cstdint>
#include <optional>

#include "collision/minkowski/feature_cache.hpp"
#include "collision/minkowski/verdict.hpp"
#include "collision/narrow_phase/feature.hpp"
#include "collision/shapes/placed_convex.hpp"

namespace enfilade::collision {

/// The arithmetic that certified a verdict.
enum class Certificate : std::uint8_t {
  filter,     ///< rounded arithmetic with a certified error bound
  expansion,  ///< exact sums of doubles
  rational    ///< integers of arbitrary length
};

/// The separation of two closed convex bodies A and B. The verdict is exact.
struct SeparationResult {
  Verdict verdict = Verdict::separated;
  Certificate certificate = Certificate::filter;
  // The smallest features that contain pointA and pointB, up to rounding; `none` if penetrating.
  // Without a hull, any two vertices count as an edge.
  Feature featureA = Feature::none, featureB = Feature::none;
  double distance = 0;          ///< metres, >= 0; 0 unless separated
  double errorBound = 0;        ///< metres: the true distance is within distance +- errorBound; at
                                ///< most 16 * 2^-53 times the largest coordinate after the
                                ///< translations are subtracted
  Vec3 pointA = Vec3::Zero();   ///< world, up to rounding. Separated: closest points of A and B.
  Vec3 pointB = Vec3::Zero();   ///< Touching, penetrating: a common point.
  Vec3 normal = Vec3::UnitY();  ///< unit, from A to B. Separated: along the closest points;
                                ///< touching: of a separating plane; penetrating: undefined (+Y)
};

/// Computes the verdict and, if separated, the distance and the closest points.
SeparationResult computeSeparation(const PlacedConvex& a, const PlacedConvex& b,
                                   FeatureCache& cache);

/// As computeSeparation(), but returns nullopt as soon as the distance is certified to exceed
/// `limit` (metres).
std::optional<SeparationResult> computeSeparationWithin(const PlacedConvex& a,
                                                        const PlacedConvex& b, double limit,
                                                        FeatureCache& cache);

/// Computes a certified lower bound (metres) of the distance of A and B from the cached axis alone.
/// It is negative or minus infinity if the axis does not separate them. Costs two support queries.
double computeSeparationLowerBound(const PlacedConvex& a, const PlacedConvex& b,
                                   const FeatureCache& cache);

/// Returns computeSeparationLowerBound() > distance (metres). Cheaper: doubles decide most cases.
bool isSeparationProved(const PlacedConvex& a, const PlacedConvex& b, double distance,
                        const FeatureCache& cache);

}  // namespace enfilade::collision
