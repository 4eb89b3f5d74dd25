// Meshes in their places under one tree of Embree's, and the way back from what a ray met to them.
// Embree's floats decide which triangle it is; everything else is read from the model's own
// corners, in doubles.
#pragma once

#include <map>
#include <vector>

#include "render/draw_list.hpp"
#include "render/raytrace/embree.hpp"
#include "render/raytrace/projected_triangle.hpp"

namespace enfilade::render {

/// One mesh in its place. Points to what outlives the tree.
struct RayPiece {
  const scene::Mesh* mesh = nullptr;
  const Eigen::Affine3d* worldFromMesh = nullptr;
  const MaterialData* material = nullptr;
  scene::EntityId id = 0;
  std::int32_t texture = -1;  ///< index into Model::textures
  Pass pass = Pass::opaque;
  /// The mesh has a tree of its own, to be shared and moved; else it is copied into this tree,
  /// which is quicker to trace.
  bool instanced = false;
};

/// A triangle of a piece.
struct PieceTriangle {
  const RayPiece* piece;
  std::uint32_t triangle;  ///< of the piece's mesh

  SeenCorners corners(const Vec3& eye) const {
    SeenCorners result;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t corner = piece->mesh->indices[3 * std::size_t{triangle} + i];
      result[i] = *piece->worldFromMesh * piece->mesh->positions[corner].cast<double>() - eye;
    }
    return result;
  }
};

/// Whether they are neighbours in one piece: two of their corners stand in the same places.
bool shareEdge(const PieceTriangle& a, const PieceTriangle& b);

/// Trees of single meshes; kept by whoever places them again and again.
class MeshTrees {
 public:
  MeshTrees(RTCDeviceTy* device, bool robust) : device_(device), robust_(robust) {}

  /// `filter` may be null; the first call for a mesh decides.
  RTCSceneTy* treeOf(const scene::Mesh& mesh, EmbreeFilter filter);

 private:
  RTCDeviceTy* device_;
  bool robust_;
  std::map<const scene::Mesh*, EmbreeScene> trees_;
};

class RayTree {
 public:
  /// What is not instanced is stored relative to `origin` (world, metres), and rays have to be
  /// given relative to it. `maskFilter` is asked about triangles of Pass::mask. Throws RenderError
  /// when there are more triangles than a tree holds.
  RayTree(RTCDeviceTy* device, bool robust, std::vector<RayPiece> pieces, const Vec3& origin,
          EmbreeFilter maskFilter, MeshTrees& meshes);

  RTCSceneTy* embree() const { return scene_.get(); }
  bool empty() const { return pieces_.empty(); }
  const std::vector<RayPiece>& pieces() const { return pieces_; }

  /// Of Embree's three numbers.
  PieceTriangle find(unsigned instance, unsigned geometry, unsigned primitive) const;

 private:
  void copy(RTCDeviceTy* device, bool mask, const Vec3& origin, EmbreeFilter filter);
  void placeInstances(RTCDeviceTy* device, const Vec3& origin, EmbreeFilter filter,
                      MeshTrees& meshes);

  std::vector<RayPiece> pieces_;
  std::vector<std::uint32_t> firstTriangle_;       ///< of each piece that is copied
  std::vector<std::uint32_t> pieceOfTriangle_[2];  ///< of geometry 0 (no mask) and 1 (mask)
  EmbreeScene scene_;
};

}  // namespace enfilade::render
