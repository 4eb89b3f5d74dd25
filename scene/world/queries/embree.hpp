// Owners of Embree objects, and functions that build trees. Does not include Embree's headers.
//
// RayCaster and the ray renderer build their trees with this file, but share no tree at run time.
// Their trees differ in layout (compact or fast), origin and copied meshes. A ray through a common
// edge hits two triangles at equal distance, and the layout decides between them, so that a shared
// tree would change answers or pictures. Also, each of the two follows snapshots on its own thread.
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
std::string embreeName();  ///< "Embree 3.13.5"

struct EmbreeSceneOptions {
  bool robust = true;    ///< no ray passes between adjacent triangles; false: a fifth faster
  bool compact = false;  ///< uses less memory
};
EmbreeScene makeEmbreeScene(RTCDeviceTy* device, const EmbreeSceneOptions& options);

/// Accepts or rejects a hit for each ray of a packet; see RTCFilterFunctionN.
using EmbreeFilter = void (*)(const RTCFilterFunctionNArguments*);

/// Buffers of a geometry under construction, in Embree's memory to avoid a copy.
struct TriangleBuffers {
  RTCGeometryTy* geometry;
  Eigen::Vector3f* positions;
  std::uint32_t* corners;  ///< three per triangle
};
/// Both sizes are above 0.
TriangleBuffers makeTriangleBuffers(RTCDeviceTy* device, std::size_t positions,
                                    std::size_t triangles);
/// Attaches them to `scene` as geometry `number`. `filter` may be null.
void attachTriangles(const TriangleBuffers& buffers, RTCSceneTy* scene, unsigned number,
                     EmbreeFilter filter = nullptr);

/// The committed tree of one geometry; `corners`: three per triangle, not empty. `filter` may be
/// null. Throws like commitScene().
EmbreeScene buildTriangleTree(RTCDeviceTy* device, const EmbreeSceneOptions& options,
                              std::span<const Eigen::Vector3f> positions,
                              std::span<const std::uint32_t> corners,
                              EmbreeFilter filter = nullptr);

/// True if Embree can hold an instance with this transform. Embree inverts it in floats, and
/// Debian's build terminates the program if that fails, as for an object that a file flattens.
bool canBeInstanced(const Eigen::Affine3d& sceneFromInstance);

/// Adds `instancedScene` to `scene`, which shares its ownership, as instance `number`. A ray hits
/// it if their masks have a common bit. canBeInstanced() must hold.
void addInstance(RTCDeviceTy* device, RTCSceneTy* scene, unsigned number,
                 RTCSceneTy* instancedScene, const Eigen::Affine3d& sceneFromInstance,
                 unsigned mask = 0xFFFF'FFFFu);

/// Builds the tree. Throws EmbreeError or std::bad_alloc if any call failed since the last commit.
void commitScene(RTCDeviceTy* device, RTCSceneTy* scene);

/// A device with one tree per mesh, for instancing. Use it on one thread at a time.
class MeshTrees {
 public:
  /// Throws EmbreeError if Embree is unavailable.
  explicit MeshTrees(const EmbreeSceneOptions& options) : options_(options) {}

  RTCDeviceTy* device() const { return device_.get(); }
  const EmbreeSceneOptions& options() const { return options_; }
  /// The tree of a mesh that has triangles and outlives this cache. `filter` may be null; only the
  /// first call for a mesh uses it.
  RTCSceneTy* findOrBuild(const Mesh& mesh, EmbreeFilter filter = nullptr);

 private:
  EmbreeSceneOptions options_;
  EmbreeDevice device_ = makeEmbreeDevice();
  std::map<const Mesh*, EmbreeScene> trees_;
};

}  // namespace enfilade::scene
