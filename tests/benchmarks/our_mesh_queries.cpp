// Our mesh queries, findNearestTriangle() and findMeshContacts(). They are exact (level decide) and
// cache the candidate triangles between queries.
#include "collision/compound/mesh_query.hpp"
#include "collision/shapes/hull.hpp"
#include "tests/benchmarks/mesh_method.hpp"

namespace enfilade::benchmarks {
namespace {

class OurMeshQuery : public MeshQuery {
 public:
  OurMeshQuery(const Points& body, const Triangles& mesh)
      : hull_(collision::buildHull(body)), mesh_(mesh) {}

  double distance(const Placement& body) override {
    const auto nearest = collision::findNearestTriangle(bodyAt(body), mesh_, cache_);
    return nearest ? nearest->separation.distance : 0;
  }
  void contacts(const Placement& body, std::vector<std::uint32_t>& triangles) override {
    collision::findMeshContacts(bodyAt(body), mesh_, cache_, contacts_);
    for (const auto* list : {&contacts_.penetrated, &contacts_.touched}) {
      for (const std::uint32_t triangle : *list) triangles.push_back(mesh_.inputIndex(triangle));
    }
  }
  void forget() override { cache_.reset(); }

 private:
  collision::PlacedConvex bodyAt(const Placement& at) const {
    return {hull_.vertices, at.translation, &at.rotation, &hull_};
  }
  collision::Hull hull_;
  collision::TriangleTree mesh_;
  collision::MeshCache cache_;
  collision::MeshContacts contacts_;
};

}  // namespace

std::vector<MeshMethod> ourMeshQueries() {
  return {{"ours: decide", true, true, [](const Points& body, const Triangles& mesh) {
             return std::make_unique<OurMeshQuery>(body, mesh);
           }}};
}

}  // namespace enfilade::benchmarks
