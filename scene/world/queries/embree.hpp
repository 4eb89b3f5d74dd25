// Owners of Embree objects, and functions that build trees. Does not include Embree's headers.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>

struct RTCDeviceTy;
struct RTCGeometryTy;
struct RTCSceneTy;
struct RTCFilterFunctionNArguments;

namespace enfilade::scene {

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

/// True if Embree can hold an instance with this transform. Embree inverts it in floats, and
/// Debian's build terminates the program if that fails, as for an object that a file flattens.
bool canBeInstanced(const Eigen::Affine3d& sceneFromInstance);

/// Adds `instancedScene` to `scene` as instance `number`. A ray hits it if their masks have a
/// common bit. canBeInstanced() must hold.
void addInstance(RTCDeviceTy* device, RTCSceneTy* scene, unsigned number,
                 RTCSceneTy* instancedScene, const Eigen::Affine3d& sceneFromInstance,
                 unsigned mask = 0xFFFF'FFFFu);

/// Builds the tree. Throws EmbreeError or std::bad_alloc if any call failed since the last commit.
void commitScene(RTCDeviceTy* device, RTCSceneTy* scene);

}  // namespace enfilade::scene
