// The cameras of a glTF file and how its animations move them. Reads JSON and buffers alone: no
// mesh, no assimp.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "scene/model/model.hpp"

namespace enfilade::scene {

/// A camera at one time, in the file's own frame and unit. It looks along `forward`.
struct GltfCameraPose {
  double time = 0;  ///< seconds
  Vec3 eye = Vec3::Zero();
  Vec3 forward = -Vec3::UnitZ(), up = Vec3::UnitY();  ///< unit, square to one another
};

struct GltfCameraPath {
  std::string name;                   ///< of its node
  double fovY = 0;                    ///< radians
  std::vector<GltfCameraPose> poses;  ///< at least one; one only where nothing moves it
  std::vector<std::string> notes;     ///< what was chosen or left out, for a person
};

/// The camera of the node (or else the camera) called `name`; "": the first that an animation
/// moves, else the first. Sampled `fps` times a second from 0 to the last key of what moves it,
/// keys held before the first one and after the last. All animations act together. Throws
/// ImportError.
GltfCameraPath sampleGltfCamera(const std::filesystem::path& file, const std::string& name,
                                double fps);

/// Where a place of the model's file lies in its scene: unit, up axis and offset as they were
/// taken.
Eigen::Affine3d sceneFromFile(const Model& model);

}  // namespace enfilade::scene
