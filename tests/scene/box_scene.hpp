// Hand-built scenes of boxes with known answers.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "scene/model/box_mesh.hpp"
#include "scene/model/shapes/shape.hpp"
#include "scene/world/data/scene.hpp"

namespace enfilade::scene::testing {

struct NamedBox {
  std::string path;
  Vec3 min, max;
};

inline std::vector<Vec3> makeBoxPoints(const Vec3& min, const Vec3& max) {
  std::vector<Vec3> points;
  for (int i = 0; i < 8; ++i)
    points.emplace_back(i & 1 ? max.x() : min.x(), i & 2 ? max.y() : min.y(),
                        i & 4 ? max.z() : min.z());
  return points;
}

/// Twelve triangles, wound outward.
inline Mesh buildBoxMesh(const Vec3& min, const Vec3& max) {
  return makeBoxMesh({min, max});
}

/// The same surface, wound the other way round.
inline Mesh turnInsideOut(Mesh mesh) {
  for (std::size_t i = 0; i < mesh.indices.size(); i += 3)
    std::swap(mesh.indices[i + 1], mesh.indices[i + 2]);
  return mesh;
}

inline Shape buildMeshShape(const Mesh& mesh) {
  const std::uint32_t first = 0;
  return buildShape({&mesh, 1}, {&first, 1});
}

inline Model makeBoxModel(const std::vector<NamedBox>& boxes) {
  Model model;
  model.source = "boxes";
  model.materials.emplace_back();
  for (const NamedBox& box : boxes) {
    model.meshes.push_back(buildBoxMesh(box.min, box.max));
    model.objects.push_back({box.path,
                             "",
                             {static_cast<std::uint32_t>(model.meshes.size() - 1)},
                             Eigen::Affine3d::Identity()});
  }
  return model;
}

inline std::shared_ptr<const Scene> makeBoxScene(const std::vector<NamedBox>& boxes) {
  return std::make_shared<const Scene>(makeBoxModel(boxes));
}

/// A floor of 20 x 20 m whose top is y = 0.
inline NamedBox makeFloorBox() {
  return {"floor", {-10, -0.2, -10}, {10, 0, 10}};
}

}  // namespace enfilade::scene::testing
