// Owners of Embree objects, and functions that build trees. Does not include Embree's headers.
//
// All trees are robust: no ray passes between adjacent triangles. They are shared by queries with
// different filters (QueryContext), so no tree contains a query's own filter. An object under
// construction belongs to one thread; a committed tree may be traced by any number of threads.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>

struct RTCDeviceTy;
struct RTCGeometryTy;
struct RTCSceneTy;
struct RTCFilterFunctionNArguments;

namespace enfilade::scene {

struct Mesh;

/// A call of Embree failed; the text names its error code.
struct EmbreeError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Deleter of Embree objects.
struct EmbreeRelease {
  void operator()(RTCDeviceTy* device) const;
  void operator()(RTCSceneTy* scene) const;
};
using EmbreeDevice = std::unique_ptr<RTCDeviceTy, EmbreeRelease>;
using EmbreeScene = std::unique_ptr<RTCSceneTy, EmbreeRelease>;

/// Builds trees with one thread, so that the tree and therefore the order of equally near hits are
/// deterministic. Throws EmbreeError.
EmbreeDevice makeEmbreeDevice();
std::string getEmbreeName();  ///< "Embree 3.13.5"

EmbreeScene makeEmbreeScene(RTCDeviceTy* device);

/// Accepts or rejects a hit for each ray of a packet; see RTCFilterFunctionN.
using EmbreeFilter = void (*)(const RTCFilterFunctionNArguments*);

/// The start of each query's context. `EmbreeContext` is RTCIntersectContext, whose own filter sees
/// all hits.
template <class EmbreeContext>
struct QueryContext {
  EmbreeContext embree;
  EmbreeFilter maskFilter;  ///< sees hits on masked triangles first; null: none is cut out
};

/// Buffers of a geometry under construction, in Embree's memory to avoid a copy.
struct TriangleBuffers {
  RTCGeometryTy* geometry;
  Eigen::Vector3f* positions;
  std::uint32_t* corners;  ///< three per triangle
};
/// Both sizes are above 0.
TriangleBuffers makeTriangleBuffers(RTCDeviceTy* device, std::size_t positions,
                                    std::size_t triangles);
/// Attaches them to `scene` as geometry `number`. `masked`: QueryContext::maskFilter sees its hits.
void attachTriangles(const TriangleBuffers& buffers, RTCSceneTy* scene, unsigned number,
                     bool masked);

/// The committed tree of one geometry; `corners`: three per triangle, not empty. Throws like
/// commitScene().
EmbreeScene buildTriangleTree(RTCDeviceTy* device, std::span<const Eigen::Vector3f> positions,
                              std::span<const std::uint32_t> corners, bool masked);

/// True if Embree can hold an instance with this transform. Embree inverts it in floats, and
/// Debian's build terminates the program if that fails, as for an object that a file flattens.
bool canBeInstanced(const Eigen::Affine3d& sceneFromInstance);

/// Adds `instancedScene` to `scene`, which shares its ownership, as instance `number`.
/// canBeInstanced() must hold.
void addInstance(RTCDeviceTy* device, RTCSceneTy* scene, unsigned number,
                 RTCSceneTy* instancedScene, const Eigen::Affine3d& sceneFromInstance);

/// Builds the tree. Throws EmbreeError or std::bad_alloc if any call failed since the last commit.
void commitScene(RTCDeviceTy* device, RTCSceneTy* scene);

/// A device with one tree per mesh, for instancing. Use it on one thread at a time.
class MeshTrees {
 public:
  RTCDeviceTy* device() const { return device_.get(); }
  /// The tree of a mesh that has triangles and outlives this cache.
  RTCSceneTy* findOrBuild(const Mesh& mesh, bool masked);
  std::size_t builtCount() const { return built_; }

 private:
  EmbreeDevice device_ = makeEmbreeDevice();
  std::map<const Mesh*, EmbreeScene> trees_;
  std::size_t built_ = 0;
};

}  // namespace enfilade::scene
