// Peer: FCL in double precision. CollisionObject::computeAABB() gives a turned body the cube of its
// bounding sphere.
#include <fcl/fcl.h>

#include "tests/benchmarks/box_method.hpp"

namespace enfilade::benchmarks {
namespace {

class FclBoxUpdate : public BoxUpdate {
 public:
  FclBoxUpdate(const Hull& hull, std::size_t bodies) {
    auto vertices = std::make_shared<std::vector<Vec3>>(hull.vertices);
    auto faces = std::make_shared<std::vector<int>>();
    for (const auto& face : hull.faces) {
      faces->push_back(static_cast<int>(face.size()));
      for (const std::uint32_t v : face) faces->push_back(static_cast<int>(v));
    }
    const auto shape =
        std::make_shared<fcl::Convexd>(vertices, static_cast<int>(hull.faces.size()), faces);
    for (std::size_t k = 0; k < bodies; ++k) objects_.emplace_back(shape);
  }

  void update(const std::vector<TurnedPose>& poses, std::vector<Aabb>& boxes) override {
    for (std::size_t k = 0; k < poses.size(); ++k) {
      objects_[k].setTransform(poses[k].orientation, poses[k].translation);
      objects_[k].computeAABB();
      const auto& box = objects_[k].getAABB();
      boxes[k] = {box.min_, box.max_};
    }
  }

 private:
  std::vector<fcl::CollisionObjectd> objects_;
};

}  // namespace

BoxMethod makeFclBoxes() {
  return {"FCL", [](const Hull& hull, std::size_t bodies) {
            return std::make_unique<FclBoxUpdate>(hull, bodies);
          }};
}

}  // namespace enfilade::benchmarks
