#include "scene/world/queries/ray_tree.hpp"

#include <algorithm>
#include <limits>
#include <string>

#include "collision/assert.hpp"

namespace enfilade::scene {
namespace {

constexpr unsigned kOpaqueGeometry = 0, kMaskGeometry = 1, kFirstInstance = 2;
constexpr unsigned kNone = 0xFFFF'FFFFu;  // Embree's RTC_INVALID_GEOMETRY_ID
// Per geometry; Embree uses 32 bits for some primitive and byte counts.
constexpr std::size_t kMaxTriangles = std::size_t{1} << 28;

/// Writes the meshes of batches consecutively.
class TriangleCopier {
 public:
  explicit TriangleCopier(const TriangleBuffers& buffers) : buffers_(buffers) {}

  void copy(const TriangleBatch& batch, const Vec3& origin) {
    const Mesh& mesh = *batch.mesh;
    const Eigen::Affine3d originFromMesh = Eigen::Translation3d(-origin) * *batch.worldFromMesh;
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
      buffers_.positions[firstPosition_ + i] =
          (originFromMesh * mesh.positions[i].cast<double>()).cast<float>();
    }
    const std::size_t corners = 3 * mesh.triangleCount();
    for (std::size_t i = 0; i < corners; ++i) {
      buffers_.corners[firstCorner_ + i] =
          static_cast<std::uint32_t>(firstPosition_) + mesh.indices[i];
    }
    firstPosition_ += mesh.positions.size();
    firstCorner_ += corners;
  }

 private:
  TriangleBuffers buffers_;
  std::size_t firstPosition_ = 0, firstCorner_ = 0;
};

bool isMasked(const TriangleBatch& batch) {
  return batch.material->alpha == Material::Alpha::mask;
}

}  // namespace

bool haveCommonEdge(const BatchTriangle& a, const BatchTriangle& b) {
  if (a.batch != b.batch) return false;
  const Mesh& mesh = *a.batch->mesh;
  const auto corner = [&](const BatchTriangle& source, std::size_t i) -> const Eigen::Vector3f& {
    return mesh.positions[mesh.indices[3 * std::size_t{source.triangle} + i]];
  };
  int common = 0;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) common += corner(a, i) == corner(b, j) ? 1 : 0;
  return common >= 2;
}

RayTree::RayTree(MeshTrees& meshes, std::vector<TriangleBatch> batches, const Vec3& origin)
    : batches_(std::move(batches)),
      firstTriangle_(batches_.size(), 0),
      scene_(makeEmbreeScene(meshes.device())) {
  for (TriangleBatch& batch : batches_) {
    batch.instanced = batch.instanced && canBeInstanced(*batch.worldFromMesh);
    firstId_ = std::min({firstId_, batch.id, batch.entity});
    lastId_ = std::max({lastId_, batch.id, batch.entity});
  }
  copyBatches(meshes.device(), false, origin);
  copyBatches(meshes.device(), true, origin);
  addInstances(meshes, origin);
  commitScene(meshes.device(), scene_.get());
}

void RayTree::copyBatches(RTCDeviceTy* device, bool masked, const Vec3& origin) {
  const auto copied = [&](const TriangleBatch& batch) {
    return !batch.instanced && isMasked(batch) == masked;
  };
  std::size_t positions = 0, triangles = 0;
  for (const TriangleBatch& batch : batches_) {
    if (!copied(batch)) continue;
    positions += batch.mesh->positions.size();
    triangles += batch.mesh->triangleCount();
  }
  if (triangles == 0) return;
  if (triangles > kMaxTriangles || positions > std::numeric_limits<std::uint32_t>::max()) {
    throw EmbreeError("the scene has " + std::to_string(triangles) +
                      " triangles, more than one ray tree can hold; load a part of it");
  }
  std::vector<std::uint32_t>& batchOf = batchOfTriangle_[masked ? 1 : 0];
  batchOf.reserve(triangles);
  const TriangleBuffers buffers = makeTriangleBuffers(device, positions, triangles);
  TriangleCopier copier(buffers);
  for (std::uint32_t index = 0; index < batches_.size(); ++index) {
    if (!copied(batches_[index])) continue;
    firstTriangle_[index] = static_cast<std::uint32_t>(batchOf.size());
    batchOf.insert(batchOf.end(), batches_[index].mesh->triangleCount(), index);
    copier.copy(batches_[index], origin);
  }
  attachTriangles(buffers, scene_.get(), masked ? kMaskGeometry : kOpaqueGeometry, masked);
}

void RayTree::addInstances(MeshTrees& meshes, const Vec3& origin) {
  for (std::uint32_t index = 0; index < batches_.size(); ++index) {
    const TriangleBatch& batch = batches_[index];
    if (!batch.instanced) continue;
    RTCSceneTy* tree = meshes.findOrBuild(*batch.mesh, isMasked(batch));
    addInstance(meshes.device(), scene_.get(), kFirstInstance + index, tree,
                Eigen::Translation3d(-origin) * *batch.worldFromMesh);
  }
}

BatchTriangle RayTree::findTriangle(unsigned instance, unsigned geometry,
                                    unsigned primitive) const {
  if (instance != kNone) {
    ENFILADE_ASSERT(instance - kFirstInstance < batches_.size());
    return {&batches_[instance - kFirstInstance], primitive};
  }
  const std::vector<std::uint32_t>& batchOf = batchOfTriangle_[geometry == kMaskGeometry ? 1 : 0];
  ENFILADE_ASSERT(primitive < batchOf.size());
  const std::uint32_t index = batchOf[primitive];
  return {&batches_[index], primitive - firstTriangle_[index]};
}

}  // namespace enfilade::scene
