#include "scene/import/assembly/coordinates.hpp"

#include <algorithm>

#include "collision/assert.hpp"

namespace enfilade::scene {

Eigen::Matrix3d makeYUpRotation(UpAxis up) {
  Eigen::Matrix3d rotation;
  switch (up) {
    case UpAxis::x:
      rotation << 0, -1, 0, 1, 0, 0, 0, 0, 1;
      break;
    case UpAxis::y:
      rotation.setIdentity();
      break;
    case UpAxis::z:
      rotation << 1, 0, 0, 0, 0, 1, 0, -1, 0;
      break;
    case UpAxis::minusX:
      rotation << 0, 1, 0, -1, 0, 0, 0, 0, 1;
      break;
    case UpAxis::minusY:
      rotation << 1, 0, 0, 0, -1, 0, 0, 0, -1;
      break;
    case UpAxis::minusZ:
      rotation << 1, 0, 0, 0, 0, -1, 0, 1, 0;
      break;
  }
  return rotation;
}

Aabb computeObjectAabb(const Model& model, const Object& object,
                       const Eigen::Affine3d& frameFromMesh) {
  Aabb box;
  for (const std::uint32_t mesh : object.meshes)
    for (const std::uint32_t i : model.meshes[mesh].indices)
      box.include(frameFromMesh * model.meshes[mesh].positions[i].cast<double>());
  return box;
}

void movePlacement(Object& object, const Vec3& offset) {
  if (!object.worldFromPlacement || offset.isZero(0)) return;
  object.worldFromPlacement =
      std::make_shared<Eigen::Affine3d>(Eigen::Translation3d(offset) * *object.worldFromPlacement);
}

double computeMedian(std::vector<double> values) {
  ENFILADE_ASSERT(!values.empty());
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace enfilade::scene
