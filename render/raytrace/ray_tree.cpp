#include "render/raytrace/ray_tree.hpp"

#include <algorithm>
#include <limits>
#include <string>

#include "render/render_error.hpp"
#include "scene/world/queries/ray_caster.hpp"

namespace enfilade::render {
namespace {

constexpr unsigned kOpaqueGeometry = 0, kMaskGeometry = 1, kFirstInstance = 2;
constexpr unsigned kNone = 0xFFFF'FFFFu;  // Embree's RTC_INVALID_GEOMETRY_ID
// Of one geometry; Embree counts primitives and the bytes of its buffers in 32 bits at places.
constexpr std::size_t kMostTriangles = std::size_t{1} << 28;

std::size_t trianglesOf(const scene::Mesh& mesh) {
  return mesh.indices.size() / 3;
}

/// Writes the meshes of pieces behind one another.
class Copier {
 public:
  explicit Copier(const OpenTriangles& open) : open_(open) {}

  void copy(const RayPiece& piece, const Vec3& origin) {
    const scene::Mesh& mesh = *piece.mesh;
    const Eigen::Affine3d originFromMesh = Eigen::Translation3d(-origin) * *piece.worldFromMesh;
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
      open_.positions[firstPosition_ + i] =
          (originFromMesh * mesh.positions[i].cast<double>()).cast<float>();
    }
    const std::size_t corners = 3 * trianglesOf(mesh);
    for (std::size_t i = 0; i < corners; ++i) {
      open_.corners[firstCorner_ + i] =
          static_cast<std::uint32_t>(firstPosition_) + mesh.indices[i];
    }
    firstPosition_ += mesh.positions.size();
    firstCorner_ += corners;
  }

 private:
  OpenTriangles open_;
  std::size_t firstPosition_ = 0, firstCorner_ = 0;
};

}  // namespace

bool shareEdge(const PieceTriangle& a, const PieceTriangle& b) {
  if (a.piece != b.piece) return false;
  const scene::Mesh& mesh = *a.piece->mesh;
  const auto corner = [&](const PieceTriangle& of, std::size_t i) -> const Eigen::Vector3f& {
    return mesh.positions[mesh.indices[3 * std::size_t{of.triangle} + i]];
  };
  int common = 0;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) common += corner(a, i) == corner(b, j) ? 1 : 0;
  return common >= 2;
}

RTCSceneTy* MeshTrees::treeOf(const scene::Mesh& mesh, EmbreeFilter filter) {
  if (const auto found = trees_.find(&mesh); found != trees_.end()) return found->second.get();
  EmbreeScene tree = newEmbreeScene(device_, robust_);
  const OpenTriangles open = openTriangles(device_, mesh.positions.size(), trianglesOf(mesh));
  std::copy(mesh.positions.begin(), mesh.positions.end(), open.positions);
  std::copy_n(mesh.indices.begin(), 3 * trianglesOf(mesh), open.corners);
  closeTriangles(open, tree.get(), 0, filter);
  commit(device_, tree.get());
  return (trees_[&mesh] = std::move(tree)).get();
}

RayTree::RayTree(RTCDeviceTy* device, bool robust, std::vector<RayPiece> pieces, const Vec3& origin,
                 EmbreeFilter maskFilter, MeshTrees& meshes)
    : pieces_(std::move(pieces)),
      firstTriangle_(pieces_.size(), 0),
      scene_(newEmbreeScene(device, robust)) {
  for (RayPiece& piece : pieces_)
    piece.instanced = piece.instanced && scene::canBeInstanced(*piece.worldFromMesh);
  copy(device, false, origin, nullptr);
  copy(device, true, origin, maskFilter);
  placeInstances(device, origin, maskFilter, meshes);
  commit(device, scene_.get());
}

void RayTree::copy(RTCDeviceTy* device, bool mask, const Vec3& origin, EmbreeFilter filter) {
  const auto copied = [&](const RayPiece& piece) {
    return !piece.instanced && (piece.pass == Pass::mask) == mask;
  };
  std::size_t positions = 0, triangles = 0;
  for (const RayPiece& piece : pieces_) {
    if (!copied(piece)) continue;
    positions += piece.mesh->positions.size();
    triangles += trianglesOf(*piece.mesh);
  }
  if (triangles == 0) return;
  if (triangles > kMostTriangles || positions > std::numeric_limits<std::uint32_t>::max()) {
    throw RenderError("the scene has " + std::to_string(triangles) +
                      " triangles, more than one tree of rays holds; load a part of it");
  }
  std::vector<std::uint32_t>& pieceOf = pieceOfTriangle_[mask ? 1 : 0];
  pieceOf.reserve(triangles);
  const OpenTriangles open = openTriangles(device, positions, triangles);
  Copier copier(open);
  for (std::uint32_t p = 0; p < pieces_.size(); ++p) {
    if (!copied(pieces_[p])) continue;
    firstTriangle_[p] = static_cast<std::uint32_t>(pieceOf.size());
    pieceOf.insert(pieceOf.end(), trianglesOf(*pieces_[p].mesh), p);
    copier.copy(pieces_[p], origin);
  }
  closeTriangles(open, scene_.get(), mask ? kMaskGeometry : kOpaqueGeometry, filter);
}

void RayTree::placeInstances(RTCDeviceTy* device, const Vec3& origin, EmbreeFilter filter,
                             MeshTrees& meshes) {
  for (std::uint32_t p = 0; p < pieces_.size(); ++p) {
    const RayPiece& piece = pieces_[p];
    if (!piece.instanced) continue;
    RTCSceneTy* tree = meshes.treeOf(*piece.mesh, piece.pass == Pass::mask ? filter : nullptr);
    Eigen::Affine3d originFromMesh = Eigen::Translation3d(-origin) * *piece.worldFromMesh;
    addInstance(device, scene_.get(), kFirstInstance + p, tree,
                originFromMesh.matrix().topRows<3>().cast<float>());
  }
}

PieceTriangle RayTree::find(unsigned instance, unsigned geometry, unsigned primitive) const {
  if (instance != kNone) return {&pieces_[instance - kFirstInstance], primitive};
  const std::uint32_t p = pieceOfTriangle_[geometry == kMaskGeometry ? 1 : 0][primitive];
  return {&pieces_[p], primitive - firstTriangle_[p]};
}

}  // namespace enfilade::render
