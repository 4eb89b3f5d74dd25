// A set of placed meshes in one Embree tree, with the mapping from hits to their triangles.
// Embree's floats only select the triangle; all results are computed from the model's corners in
// doubles.
#pragma once

#include <array>
#include <vector>

#include "scene/model/coplanar_surfaces.hpp"
#include "scene/model/model.hpp"
#include "scene/world/data/snapshot.hpp"
#include "scene/world/queries/embree.hpp"

namespace enfilade::scene {

/// One placed mesh. All pointers must outlive the tree.
struct TriangleBatch {
  const Mesh* mesh = nullptr;
  const Eigen::Affine3d* worldFromMesh = nullptr;
  const Material* material = nullptr;
  EntityId id = 0;            ///< of the object or avatar
  EntityId entity = 0;        ///< of the body to which the object belongs; otherwise as `id`
  std::int32_t texture = -1;  ///< index into Model::textures
  const CoplanarRank* coplanar = nullptr;  ///< null: rank 0
  /// true: the mesh has its own tree, which can be shared and moved. false: it is copied into this
  /// tree, which is faster to trace.
  bool instanced = false;

  std::uint8_t coplanarRank() const { return coplanar ? coplanar->rank : std::uint8_t{0}; }
};

/// A triangle of a batch.
struct BatchTriangle {
  const TriangleBatch* batch;
  std::uint32_t triangle;  ///< index in the batch's mesh

  /// World axes, metres, relative to `origin`.
  std::array<Vec3, 3> corners(const Vec3& origin) const {
    std::array<Vec3, 3> result;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t corner = batch->mesh->indices[3 * std::size_t{triangle} + i];
      result[i] = *batch->worldFromMesh * batch->mesh->positions[corner].cast<double>() - origin;
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
  /// Throws EmbreeError if there are more triangles than a tree can hold, and as commitScene().
  RayTree(MeshTrees& meshes, std::vector<TriangleBatch> batches, const Vec3& origin);

  RTCSceneTy* embreeScene() const { return scene_.get(); }
  /// False: no batch has this id, and none is part of this entity.
  bool mayContain(EntityId id) const { return id >= firstId_ && id <= lastId_; }

  /// The triangle of a hit, from Embree's three ids.
  BatchTriangle findTriangle(unsigned instance, unsigned geometry, unsigned primitive) const;

 private:
  void copyBatches(RTCDeviceTy* device, bool masked, const Vec3& origin);
  void addInstances(MeshTrees& meshes, const Vec3& origin);

  std::vector<TriangleBatch> batches_;
  EntityId firstId_ = ~EntityId{0}, lastId_ = 0;   ///< least and greatest
  std::vector<std::uint32_t> firstTriangle_;       ///< of each copied batch
  std::vector<std::uint32_t> batchOfTriangle_[2];  ///< for geometry 0 (not masked) and 1 (masked)
  EmbreeScene scene_;
};

}  // namespace enfilade::scene
