// Peer: FCL's tree of OBBRSS volumes (oriented boxes and rectangle swept spheres) against a convex
// shape, by its public functions; contacts without positions.
#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/geometry/shape/convex.h>
#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/distance.h>

#include "collision/shapes/hull.hpp"
#include "tests/benchmarks/mesh_method.hpp"

namespace enfilade::benchmarks {
namespace {

using Model = fcl::BVHModel<fcl::OBBRSSd>;

std::unique_ptr<fcl::Convexd> convexOf(const Points& points) {
  const collision::Hull hull = collision::buildHull(points);
  auto vertices = std::make_shared<const std::vector<Vec3>>(hull.vertices);
  auto faces = std::make_shared<std::vector<int>>();
  for (const auto& face : hull.faces) {
    faces->push_back(static_cast<int>(face.size()));
    for (const std::uint32_t vertex : face) faces->push_back(static_cast<int>(vertex));
  }
  auto shape = std::make_unique<fcl::Convexd>(vertices, static_cast<int>(hull.faces.size()), faces);
  shape->computeLocalAABB();
  return shape;
}

class FclMeshQuery : public MeshQuery {
 public:
  FclMeshQuery(const Points& body, const Triangles& mesh) : body_(convexOf(body)) {
    model_.beginModel(static_cast<int>(mesh.size()), static_cast<int>(3 * mesh.size()));
    for (const Triangle& t : mesh) model_.addTriangle(t[0], t[1], t[2]);
    model_.endModel();
    model_.computeLocalAABB();
  }

  double distance(const Placement& body) override {
    fcl::DistanceRequestd request;
    fcl::DistanceResultd result;
    fcl::distance(&model_, fcl::Transform3d::Identity(), body_.get(), transformOf(body), request,
                  result);
    return std::max(0.0, result.min_distance);
  }
  void contacts(const Placement& body, std::vector<std::uint32_t>& triangles) override {
    fcl::CollisionRequestd request(model_.num_tris);
    fcl::CollisionResultd result;
    fcl::collide(&model_, fcl::Transform3d::Identity(), body_.get(), transformOf(body), request,
                 result);
    for (std::size_t k = 0; k < result.numContacts(); ++k) {
      triangles.push_back(static_cast<std::uint32_t>(result.getContact(k).b1));
    }
  }

 private:
  static fcl::Transform3d transformOf(const Placement& at) {
    fcl::Transform3d transform = fcl::Transform3d::Identity();
    transform.linear() = at.rotation;
    transform.translation() = at.translation;
    return transform;
  }
  std::unique_ptr<fcl::Convexd> body_;
  Model model_;
};

}  // namespace

std::vector<MeshMethod> fclMesh() {
  return {{"FCL OBBRSS", false, false, [](const Points& body, const Triangles& mesh) {
             return std::make_unique<FclMeshQuery>(body, mesh);
           }}};
}

}  // namespace enfilade::benchmarks
