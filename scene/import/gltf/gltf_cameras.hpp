// Samples the animated cameras of a glTF file. Reads only JSON and buffers: no meshes, no assimp.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "scene/model/model.hpp"

namespace enfilade::scene {

/// A camera at one time, in the file's own frame and unit. Its view direction is `forward`.
struct GltfCameraPose {
  double time = 0;  ///< seconds
  Vec3 eye = Vec3::Zero();
  Vec3 forward = -Vec3::UnitZ(), up = Vec3::UnitY();  ///< unit length, orthogonal
};

/// The sampled poses of one camera.
struct GltfCameraPath {
  std::string name;                   ///< of the camera's node
  double fovY = 0;                    ///< radians
  std::vector<GltfCameraPose> poses;  ///< at least one; exactly one if the camera is not animated
  std::vector<std::string> notes;     ///< readable remarks, such as ignored channels
};

/// Samples the camera whose node, or itself, is named `name`; "": the first animated camera,
/// otherwise the first. Samples `fps` times a second from 0 to the last key that affects it; values
/// are constant before the first and after the last key. All animations act together. Throws
/// ImportError.
GltfCameraPath sampleGltfCamera(const std::filesystem::path& file, const std::string& name,
                                double fps);

/// Transforms a position of the model's file to the scene: applies unit, up axis and offset.
Eigen::Affine3d computeSceneFromFile(const Model& model);

}  // namespace enfilade::scene
