#include "tests/accuracy/mesh_brute_force.hpp"

#include <algorithm>

#include "collision/narrow_phase/refine.hpp"

namespace enfilade::accuracy {
namespace {

using namespace collision;

ConvexBody bodyOf(const Triangle& triangle) {
  return {triangle};
}

std::vector<Decision> decideAll(const ConvexBody& body, std::span<const Triangle> mesh) {
  std::vector<Decision> decisions;
  for (const Triangle& triangle : mesh) {
    FeatureCache cache;
    decisions.push_back(decide(body, bodyOf(triangle), cache));
  }
  return decisions;
}

void takeContact(const std::vector<Decision>& decisions, MeshContact& contact) {
  for (std::uint32_t i = 0; i < decisions.size(); ++i) {
    contact.decidedBy = std::max(contact.decidedBy, decisions[i].decidedBy);
    if (decisions[i].verdict == Verdict::penetrating) contact.penetrated.push_back(i);
    if (decisions[i].verdict == Verdict::touching) contact.touched.push_back(i);
  }
  if (!contact.penetrated.empty()) {
    contact.verdict = Verdict::penetrating;
    contact.nearest = contact.penetrated.front();
  } else if (!contact.touched.empty()) {
    contact.verdict = Verdict::touching;
    contact.nearest = contact.touched.front();
  }
  if (!contact.nearest) return;
  contact.pointA = decisions[*contact.nearest].pointA;
  contact.pointB = decisions[*contact.nearest].pointB;
}

/// Another triangle may be nearer by its own bound, and the nearest is no further than this one's.
void takeNearest(const std::vector<Decision>& decisions, MeshContact& contact) {
  const auto nearest = std::min_element(
      decisions.begin(), decisions.end(),
      [](const Decision& p, const Decision& q) { return p.distance < q.distance; });
  contact.nearest = static_cast<std::uint32_t>(nearest - decisions.begin());
  contact.distance = nearest->distance;
  contact.pointA = nearest->pointA;
  contact.pointB = nearest->pointB;
  for (const Decision& d : decisions)
    contact.errorBound = std::max(contact.errorBound, contact.distance - d.distance + d.errorBound);
}

/// Among the triangles whose bounds let them be the nearest.
void takeNearestRefined(const ConvexBody& body, std::span<const Triangle> mesh,
                        const std::vector<Decision>& decisions, MeshContact& contact) {
  double reach = std::numeric_limits<double>::infinity();
  for (const Decision& d : decisions) reach = std::min(reach, d.distance + d.errorBound);
  contact.distance = std::numeric_limits<double>::infinity();
  for (std::uint32_t i = 0; i < decisions.size(); ++i) {
    if (decisions[i].distance - decisions[i].errorBound > reach) continue;
    FeatureCache cache;
    const Refinement refined = refine(body, bodyOf(mesh[i]), cache);
    if (refined.distance >= contact.distance) continue;
    contact.nearest = i;
    contact.distance = refined.distance;
    contact.pointA = refined.pointA;
    contact.pointB = refined.pointB;
  }
  contact.errorBound = 1e-15 * contact.distance;
}

}  // namespace

MeshContact bruteForceContact(const ConvexBody& body, std::span<const Triangle> mesh,
                              bool refined) {
  MeshContact contact;
  const std::vector<Decision> decisions = decideAll(body, mesh);
  if (decisions.empty()) {
    contact.distance = std::numeric_limits<double>::infinity();
    return contact;
  }
  takeContact(decisions, contact);
  if (contact.verdict != Verdict::separated) return contact;
  if (refined)
    takeNearestRefined(body, mesh, decisions, contact);
  else
    takeNearest(decisions, contact);
  return contact;
}

}  // namespace enfilade::accuracy
