// A set of placed meshes in one Embree tree, with the mapping from hits to their triangles.
// Embree's floats only select the triangle; all results are computed from the model's corners in
// doubles.
#pragma once

#include <vector>

#include "render/draw_list.hpp"
#include "render/raytrace/projected_triangle.hpp"
#include "scene/world/queries/embree.hpp"

namespace enfilade::render {

/// One placed mesh. All pointers must outlive the tree.
struct TriangleBatch {
  const scene::Mesh* mesh = nullptr;
  const Eigen::Affine3d* worldFromMesh = nullptr;
  const MaterialData* material = nullptr;
  scene::EntityId id = 0;
  std::int32_t texture = -1;  ///< index into Model::textures
  AlphaMode alphaMode = AlphaMode::opaque;
  /// true: the mesh has its own tree, which can be shared and moved. false: it is copied into this
  /// tree, which is faster to trace.
  bool instanced = false;
};

/// A triangle of a batch.
struct BatchTriangle {
  const TriangleBatch* batch;
  std::uint32_t triangle;  ///< index in the batch's mesh

  EyeSpaceCorners corners(const Vec3& eye) const {
    EyeSpaceCorners result;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t corner = batch->mesh->indices[3 * std::size_t{triangle} + i];
      result[i] = *batch->worldFromMesh * batch->mesh->positions[corner].cast<double>() - eye;
    }
    return result;
  }
};

/// Whether both are in the same batch and share two corner positions.
bool haveCommonEdge(const BatchTriangle& a, const BatchTriangle& b);

/// An Embree tree of batches.
class RayTree {
 public:
  /// Geometry is stored relative to `origin` (world, metres); rays must be relative to it, too.
  /// `maskFilter` filters hits on triangles of AlphaMode::mask. Throws RenderError if there are
  /// more triangles than a tree can hold.
  RayTree(scene::MeshTrees& meshes, std::vector<TriangleBatch> batches, const Vec3& origin,
          scene::EmbreeFilter maskFilter);

  RTCSceneTy* embreeScene() const { return scene_.get(); }
  bool empty() const { return batches_.empty(); }
  /// False: no batch has this id.
  bool mayContain(scene::EntityId id) const { return id >= firstId_ && id <= lastId_; }
  const std::vector<TriangleBatch>& batches() const { return batches_; }

  /// The triangle of a hit, from Embree's three ids.
  BatchTriangle findTriangle(unsigned instance, unsigned geometry, unsigned primitive) const;

 private:
  void copyBatches(RTCDeviceTy* device, bool mask, const Vec3& origin, scene::EmbreeFilter filter);
  void addInstances(scene::MeshTrees& meshes, const Vec3& origin, scene::EmbreeFilter filter);

  std::vector<TriangleBatch> batches_;
  scene::EntityId firstId_ = ~scene::EntityId{0}, lastId_ = 0;  ///< least and greatest
  std::vector<std::uint32_t> firstTriangle_;                    ///< of each copied batch
  std::vector<std::uint32_t> batchOfTriangle_[2];  ///< for geometry 0 (not masked) and 1 (masked)
  scene::EmbreeScene scene_;
};

}  // namespace enfilade::render
