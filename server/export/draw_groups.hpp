// Decides how the objects of a scene are drawn by few draw calls, for scene_glb.
//
// Steps:
//   1. Bodies move, so each is drawn on its own. Triggers and collision-only objects are not drawn.
//   2. Static objects with the same list of meshes are candidates for instancing. At least
//      kMinInstances of them must have a transform of translation, rotation and positive scale. A
//      viewer that draws instances does not reverse the winding of mirrored ones, and glTF has no
//      shear.
//   3. Candidates that save the most vertices become instance groups, up to kMaxInstancedPrimitives
//      draw calls.
//   4. All other static objects are merged by material into batches, in the scene's frame.
//
// The number of draw calls is then at most kMaxInstancedPrimitives, plus two a material (with and
// without normals), plus the meshes of the bodies. It does not grow with the static objects.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <vector>

#include "scene/model/model.hpp"

namespace enfilade::server {

/// Below this number of uses, merged copies cost less than a draw call of their own.
inline constexpr std::size_t kMinInstances = 8;
/// Half of the 500 draw calls that a browser on a laptop draws in a frame without effort.
inline constexpr std::size_t kMaxInstancedPrimitives = 256;

/// A transform as glTF stores it: scale first, then rotation, then translation.
struct TrsTransform {
  scene::Vec3 translation = scene::Vec3::Zero();
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();  ///< unit
  scene::Vec3 scale = scene::Vec3::Ones();                       ///< positive
};

/// nullopt: the transform mirrors, shears or flattens.
std::optional<TrsTransform> decomposeTrs(const Eigen::Affine3d& transform);

/// Static objects with the same meshes: one node with an instance per object.
struct InstanceGroup {
  std::vector<std::uint32_t> meshes;     ///< indices into Model::meshes, with triangles
  std::vector<std::uint32_t> objects;    ///< indices into Model::objects, ascending
  std::vector<TrsTransform> transforms;  ///< worldFromMesh of each object
};

/// A mesh of an object.
struct MeshUse {
  std::uint32_t object = 0, mesh = 0;
};

/// Meshes with the same material, merged to one primitive.
struct MeshBatch {
  std::uint32_t material = 0;  ///< see findEqualMaterials(); may lie behind the model's materials
  bool hasNormals = false;     ///< all of its meshes have normals, or none
  bool hasColours = false;     ///< all of its meshes have vertex colours, or none
  std::vector<MeshUse> uses;   ///< by object, ascending
};

struct DrawGroups {
  std::vector<InstanceGroup> instanced;  ///< by first object
  std::vector<MeshBatch> batches;        ///< by material, then without and with normals
  std::vector<std::uint32_t> bodies;     ///< indices into Model::bodies, without triggers
};

/// For each texture the first one with the same pixels.
std::vector<std::uint32_t> findEqualTextures(const scene::Model& model);

/// For each material the first one that looks the same; names may differ. One more entry at the end
/// is that of meshes without a material.
std::vector<std::uint32_t> findEqualMaterials(const scene::Model& model);

/// The material of a mesh in the list of findEqualMaterials().
std::uint32_t findMaterial(const scene::Mesh& mesh,
                           const std::vector<std::uint32_t>& equalMaterials);

/// Whether the object is part of the drawn scene: no trigger, not only for collision.
std::vector<bool> findDrawnObjects(const scene::Model& model);

DrawGroups makeDrawGroups(const scene::Model& model);

}  // namespace enfilade::server
