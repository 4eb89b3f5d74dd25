// Our mesh queries: the distance by findNearestParts(), as a client's question; the contacts by the
// triangles' tree and the narrow phase, as an avatar's. Both are exact and keep nothing.
#include "collision/compound/nearest_parts.hpp"
#include "collision/shapes/hull.hpp"
#include "tests/benchmarks/mesh_method.hpp"

namespace enfilade::benchmarks {
namespace {

using namespace collision;

class OurMeshQuery : public MeshQuery {
 public:
  OurMeshQuery(const Points& body, const Triangles& mesh)
      : hull_(buildHull(body)),
        tree_(buildBoxTree(std::span(&computeLocalBox(), 1), 1)),
        mesh_(mesh) {}

  double computeDistance(const RigidTransform& at) override {
    const CompoundView body{&tree_, at.rotation, at.translation,
                            [&](std::uint32_t) { return placeBodyAt(at); }};
    const CompoundView mesh{&mesh_.boxes(), Mat3::Identity(), Vec3::Zero(),
                            [this](std::uint32_t i) { return getTriangle(i); },
                            [this](std::uint32_t i) { return computeAabb(mesh_.triangles()[i]); }};
    std::size_t budget = std::numeric_limits<std::size_t>::max();
    return findNearestParts({&body, 1}, {&mesh, 1}, std::numeric_limits<double>::infinity(), budget)
        .separation.distance;
  }
  void findContacts(const RigidTransform& at, std::vector<std::uint32_t>& triangles) override {
    const PlacedConvex body = placeBodyAt(at);
    Aabb box;
    for (const Vec3& vertex : body.vertices) box.include(at.rotation * vertex + at.translation);
    near_.clear();
    mesh_.query(inflate(box, 1e-9), near_);  // more than the rounding of the box
    for (const std::uint32_t i : near_) {
      FeatureCache cold;
      const auto separation = computeSeparationWithin(body, getTriangle(i), 0, cold);
      if (separation && separation->verdict != Verdict::separated)
        triangles.push_back(mesh_.inputIndex(i));
    }
  }

 private:
  const Aabb& computeLocalBox() {
    for (const Vec3& vertex : hull_.vertices) box_.include(vertex);
    return box_;
  }
  PlacedConvex placeBodyAt(const RigidTransform& at) const {
    return {hull_.vertices, at.translation, &at.rotation, &hull_};
  }
  PlacedConvex getTriangle(std::uint32_t i) const { return {mesh_.triangles()[i]}; }

  Hull hull_;
  Aabb box_;  ///< of the hull, in its frame
  BoxTree tree_;
  TriangleTree mesh_;
  std::vector<std::uint32_t> near_;  ///< scratch
};

}  // namespace

std::vector<MeshMethod> makeOurMeshQueries() {
  return {{"ours: decide", true, false, [](const Points& body, const Triangles& mesh) {
             return std::make_unique<OurMeshQuery>(body, mesh);
           }}};
}

}  // namespace enfilade::benchmarks
