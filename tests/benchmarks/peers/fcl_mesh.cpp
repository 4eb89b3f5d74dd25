// Peer: FCL's tree of OBBRSS volumes (oriented boxes and rectangle swept spheres) against a convex
// shape, by its public functions; contacts without positions.
#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/distance.h>

#include "tests/benchmarks/mesh_method.hpp"
#include "tests/benchmarks/peers/fcl_shapes.hpp"

namespace enfilade::benchmarks {
namespace {

using Model = fcl::BVHModel<fcl::OBBRSSd>;

class FclMeshQuery : public MeshQuery {
 public:
  FclMeshQuery(const Points& body, const Triangles& mesh) : body_(makeFclConvex(body)) {
    body_->computeLocalAABB();
    model_.beginModel(static_cast<int>(mesh.size()), static_cast<int>(3 * mesh.size()));
    for (const Triangle& t : mesh) model_.addTriangle(t[0], t[1], t[2]);
    model_.endModel();
    model_.computeLocalAABB();
  }

  double computeDistance(const RigidTransform& body) override {
    fcl::DistanceRequestd request;
    fcl::DistanceResultd result;
    fcl::distance(&model_, fcl::Transform3d::Identity(), body_.get(), toFcl(body), request, result);
    return std::max(0.0, result.min_distance);
  }
  void findContacts(const RigidTransform& body, std::vector<std::uint32_t>& triangles) override {
    fcl::CollisionRequestd request(model_.num_tris);
    fcl::CollisionResultd result;
    fcl::collide(&model_, fcl::Transform3d::Identity(), body_.get(), toFcl(body), request, result);
    for (std::size_t k = 0; k < result.numContacts(); ++k) {
      triangles.push_back(static_cast<std::uint32_t>(result.getContact(k).b1));
    }
  }

 private:
  std::unique_ptr<fcl::Convexd> body_;
  Model model_;
};

}  // namespace

std::vector<MeshMethod> makeFclMeshMethods() {
  return {{"FCL OBBRSS", false, false, [](const Points& body, const Triangles& mesh) {
             return std::make_unique<FclMeshQuery>(body, mesh);
           }}};
}

}  // namespace enfilade::benchmarks
