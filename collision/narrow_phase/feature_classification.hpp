// Classifies the features (vertex, edge, face) that contain the closest points. Internal to the
// narrow phase.
#pragma once

#include <cstdint>

#include "collision/assert.hpp"
#include "collision/minkowski/feature_cache.hpp"
#include "collision/minkowski/verdict.hpp"
#include "collision/narrow_phase/feature.hpp"
#include "collision/shapes/hull.hpp"
#include "collision/shapes/placed_convex.hpp"

namespace enfilade::collision {

/// Finds the feature spanned by the vertices of one body in `finalFeatures`. All of them have a
/// positive weight in the closest point and lie on one face, since the point is on the surface.
inline Feature findSpannedFeature(const PlacedConvex& convex, const FeatureCache& finalFeatures,
                                  std::uint32_t VertexPair::*vertex) {
  ENFILADE_ASSERT(finalFeatures.size >= 1 && finalFeatures.size <= 4);
  const std::uint32_t first = finalFeatures.pairs[0].*vertex;
  std::uint32_t second = first;
  for (int i = 1; i < finalFeatures.size; ++i) {
    const std::uint32_t next = finalFeatures.pairs[i].*vertex;
    if (next == first || next == second) continue;
    if (second != first) return Feature::face;
    second = next;
  }
  if (second == first) return Feature::vertex;
  if (!convex.hull) return Feature::edge;
  for (const std::uint32_t neighbour : convex.hull->getNeighbours(first))
    if (neighbour == second) return Feature::edge;
  return Feature::face;  // the two vertices are a diagonal of a face
}

/// Sets featureA and featureB of a SeparationResult or a RefinedSeparation from the final features.
template <class Answer>
void assignFeatures(const PlacedConvex& a, const PlacedConvex& b, const FeatureCache& finalFeatures,
                    Answer& result) {
  if (result.verdict == Verdict::penetrating) return;
  result.featureA = findSpannedFeature(a, finalFeatures, &VertexPair::a);
  result.featureB = findSpannedFeature(b, finalFeatures, &VertexPair::b);
}

}  // namespace enfilade::collision
