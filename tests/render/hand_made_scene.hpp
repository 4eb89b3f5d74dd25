// Hand-made scenes of boxes and panes whose images can be computed on paper.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "render/gl/gl_renderer.hpp"
#include "scene/model/box_mesh.hpp"

namespace enfilade::render {

/// A box from -1/2 to 1/2 on each axis, eight corners, no normals.
inline scene::Mesh makeUnitCube() {
  return scene::makeBoxMesh({Vec3::Constant(-0.5), Vec3::Constant(0.5)});
}

struct PlacedBox {
  Vec3 centre, size;  ///< metres; a negative size mirrors
  scene::Material material = {};
};

/// Object i is box i, so its id is i + 1.
inline std::shared_ptr<const scene::Scene> makeScene(const std::vector<PlacedBox>& boxes) {
  scene::Model model;
  model.source = "boxes made by hand";
  for (const PlacedBox& box : boxes) {
    const auto index = static_cast<std::uint32_t>(model.objects.size());
    scene::Mesh mesh = makeUnitCube();
    mesh.material = index;
    model.materials.push_back(box.material);
    model.meshes.push_back(std::move(mesh));
    scene::Object object;
    object.path = "box" + std::to_string(index);
    object.meshes = {index};
    object.worldFromMesh.linear() = box.size.asDiagonal();
    object.worldFromMesh.translation() = box.centre;
    model.objects.push_back(std::move(object));
  }
  return std::make_shared<const scene::Scene>(std::move(model));
}

inline scene::Material makeColoured(float r, float g, float b, float alpha = 1) {
  scene::Material material;
  material.baseColour = {r, g, b, alpha};
  if (alpha < 1) material.alpha = scene::Material::Alpha::blend;
  return material;
}

/// A camera at the origin that looks along -z, 90 degrees both ways: at distance z the image is 2 z
/// wide.
inline Camera makeSquareCamera(int size = 200) {
  Camera camera;
  camera.forward = -Vec3::UnitZ();
  camera.fovY = 1.5707963267948966;
  camera.width = size;
  camera.height = size;
  return camera;
}

inline std::size_t getPixelIndex(const Frame& frame, int x, int y) {
  return static_cast<std::size_t>(y) * static_cast<std::size_t>(frame.camera.width) +
         static_cast<std::size_t>(x);
}

}  // namespace enfilade::render
