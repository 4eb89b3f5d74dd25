#include "tests/accuracy/mesh_brute_force.hpp"

#include <algorithm>

#include "collision/narrow_phase/refine.hpp"

namespace enfilade::accuracy {
namespace {

using namespace collision;

PlacedConvex makeBody(const Triangle& triangle) {
  return {triangle};
}

std::vector<SeparationResult> decideAll(const PlacedConvex& body, std::span<const Triangle> mesh) {
  std::vector<SeparationResult> separations;
  for (const Triangle& triangle : mesh) {
    FeatureCache cache;
    separations.push_back(computeSeparation(body, makeBody(triangle), cache));
  }
  return separations;
}

void takeContact(const std::vector<SeparationResult>& separations, MeshContact& contact) {
  for (std::uint32_t i = 0; i < separations.size(); ++i) {
    contact.decidedBy = std::max(contact.decidedBy, separations[i].certificate);
    if (separations[i].verdict == Verdict::penetrating) contact.penetrated.push_back(i);
    if (separations[i].verdict == Verdict::touching) contact.touched.push_back(i);
  }
  if (!contact.penetrated.empty()) {
    contact.verdict = Verdict::penetrating;
    contact.nearest = contact.penetrated.front();
  } else if (!contact.touched.empty()) {
    contact.verdict = Verdict::touching;
    contact.nearest = contact.touched.front();
  }
  if (!contact.nearest) return;
  contact.pointA = separations[*contact.nearest].pointA;
  contact.pointB = separations[*contact.nearest].pointB;
}

/// Takes the nearest triangle, with an error bound that covers all triangles that may be nearer.
void takeNearest(const std::vector<SeparationResult>& separations, MeshContact& contact) {
  const auto nearest = std::min_element(
      separations.begin(), separations.end(),
      [](const SeparationResult& p, const SeparationResult& q) { return p.distance < q.distance; });
  contact.nearest = static_cast<std::uint32_t>(nearest - separations.begin());
  contact.distance = nearest->distance;
  contact.pointA = nearest->pointA;
  contact.pointB = nearest->pointB;
  for (const SeparationResult& d : separations)
    contact.errorBound = std::max(contact.errorBound, contact.distance - d.distance + d.errorBound);
}

/// Refines the triangles that may be the nearest by their error bounds.
void takeNearestRefined(const PlacedConvex& body, std::span<const Triangle> mesh,
                        const std::vector<SeparationResult>& separations, MeshContact& contact) {
  double reach = std::numeric_limits<double>::infinity();
  for (const SeparationResult& d : separations) reach = std::min(reach, d.distance + d.errorBound);
  contact.distance = std::numeric_limits<double>::infinity();
  for (std::uint32_t i = 0; i < separations.size(); ++i) {
    if (separations[i].distance - separations[i].errorBound > reach) continue;
    FeatureCache cache;
    const RefinedSeparation refined = refineSeparation(body, makeBody(mesh[i]), cache);
    if (refined.distance >= contact.distance) continue;
    contact.nearest = i;
    contact.distance = refined.distance;
    contact.pointA = refined.pointA;
    contact.pointB = refined.pointB;
  }
  contact.errorBound = 1e-15 * contact.distance;
}

}  // namespace

MeshContact findContactByBruteForce(const PlacedConvex& body, std::span<const Triangle> mesh,
                                    bool refined) {
  MeshContact contact;
  const std::vector<SeparationResult> separations = decideAll(body, mesh);
  if (separations.empty()) {
    contact.distance = std::numeric_limits<double>::infinity();
    return contact;
  }
  takeContact(separations, contact);
  if (contact.verdict != Verdict::separated) return contact;
  if (refined)
    takeNearestRefined(body, mesh, separations, contact);
  else
    takeNearest(separations, contact);
  return contact;
}

}  // namespace enfilade::accuracy
