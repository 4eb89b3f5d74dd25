// Of what features closest points are points. Internal to the narrow phase.
#pragma once

#include "collision/narrow_phase/narrow_phase.hpp"
#include "collision/shapes/hull.hpp"

namespace enfilade::collision {

/// What the vertices span that a closest point of one body was combined of, each with a positive
/// weight. They lie on one face, since the point is on the surface.
inline Feature spannedBy(const ConvexBody& body, const FeatureCache& ended,
                         std::uint32_t VertexPair::*vertex) {
  const std::uint32_t first = ended.pairs[0].*vertex;
  std::uint32_t second = first;
  for (int i = 1; i < ended.size; ++i) {
    const std::uint32_t next = ended.pairs[i].*vertex;
    if (next == first || next == second) continue;
    if (second != first) return Feature::face;
    second = next;
  }
  if (second == first) return Feature::vertex;
  if (!body.hull) return Feature::edge;
  for (const std::uint32_t joined : body.hull->neighboursOf(first))
    if (joined == second) return Feature::edge;
  return Feature::face;  // they are its diagonal
}

/// Into a Decision or a Refinement, by the features that its search ended at.
template <class Answer>
void tellFeatures(const ConvexBody& a, const ConvexBody& b, const FeatureCache& ended,
                  Answer& answer) {
  if (answer.verdict == Verdict::penetrating) return;
  answer.featureA = spannedBy(a, ended, &VertexPair::a);
  answer.featureB = spannedBy(b, ended, &VertexPair::b);
}

}  // namespace enfilade::collision
