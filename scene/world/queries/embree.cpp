#include "scene/world/queries/embree.hpp"

#include <embree3/rtcore.h>

#include <algorithm>
#include <new>

#include "collision/assert.hpp"
#include "scene/model/model.hpp"

namespace enfilade::scene {
namespace {

void throwIfEmbreeFailed(RTCDevice device, const char* doing) {
  const RTCError error = rtcGetDeviceError(device);
  if (error == RTC_ERROR_NONE) return;
  if (error == RTC_ERROR_OUT_OF_MEMORY) throw std::bad_alloc();
  throw EmbreeError(std::string("Embree failed with error ") + std::to_string(error) + " while " +
                    doing);
}

void filterMaskedHits(const RTCFilterFunctionNArguments* arguments) {
  const auto* context =
      reinterpret_cast<const QueryContext<RTCIntersectContext>*>(arguments->context);
  if (context->maskFilter) context->maskFilter(arguments);
}

}  // namespace

void EmbreeRelease::operator()(RTCDeviceTy* device) const {
  rtcReleaseDevice(device);
}
void EmbreeRelease::operator()(RTCSceneTy* scene) const {
  rtcReleaseScene(scene);
}

EmbreeDevice makeEmbreeDevice() {
  EmbreeDevice device(rtcNewDevice("threads=1,set_affinity=0"));
  if (!device) {
    throw EmbreeError("Embree cannot create a device: error " +
                      std::to_string(rtcGetDeviceError(nullptr)));
  }
  return device;
}

std::string getEmbreeName() {
  return "Embree " RTC_VERSION_STRING;
}

EmbreeScene makeEmbreeScene(RTCDeviceTy* device) {
  EmbreeScene scene(rtcNewScene(device));
  rtcSetSceneFlags(scene.get(), static_cast<RTCSceneFlags>(RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION |
                                                           RTC_SCENE_FLAG_ROBUST));
  rtcSetSceneBuildQuality(scene.get(), RTC_BUILD_QUALITY_MEDIUM);
  return scene;
}

TriangleBuffers makeTriangleBuffers(RTCDeviceTy* device, std::size_t positions,
                                    std::size_t triangles) {
  ENFILADE_ASSERT(positions > 0 && triangles > 0);
  const RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  TriangleBuffers buffers{geometry, nullptr, nullptr};
  buffers.positions = static_cast<Eigen::Vector3f*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(Eigen::Vector3f), positions));
  buffers.corners = static_cast<std::uint32_t*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(std::uint32_t), triangles));
  if (!buffers.positions || !buffers.corners) {
    rtcReleaseGeometry(geometry);
    throwIfEmbreeFailed(device, "allocating triangles");
    throw std::bad_alloc();
  }
  return buffers;
}

void attachTriangles(const TriangleBuffers& buffers, RTCSceneTy* scene, unsigned number,
                     bool masked) {
  if (masked) {
    rtcSetGeometryIntersectFilterFunction(buffers.geometry, filterMaskedHits);
    rtcSetGeometryOccludedFilterFunction(buffers.geometry, filterMaskedHits);
  }
  rtcCommitGeometry(buffers.geometry);
  rtcAttachGeometryByID(scene, buffers.geometry, number);
  rtcReleaseGeometry(buffers.geometry);
}

EmbreeScene buildTriangleTree(RTCDeviceTy* device, std::span<const Eigen::Vector3f> positions,
                              std::span<const std::uint32_t> corners, bool masked) {
  ENFILADE_ASSERT(!corners.empty() && corners.size() % 3 == 0);
  const std::size_t triangles = corners.size() / 3;
  const TriangleBuffers buffers = makeTriangleBuffers(device, positions.size(), triangles);
  std::copy(positions.begin(), positions.end(), buffers.positions);
  std::copy_n(corners.begin(), 3 * triangles, buffers.corners);
  EmbreeScene tree = makeEmbreeScene(device);
  attachTriangles(buffers, tree.get(), 0, masked);
  commitScene(device, tree.get());
  return tree;
}

bool canBeInstanced(const Eigen::Affine3d& sceneFromInstance) {
  const Eigen::Matrix3f linear = sceneFromInstance.linear().cast<float>();
  const Eigen::Matrix3f inverse = linear.inverse();
  const Eigen::Vector3f origin = inverse * sceneFromInstance.translation().cast<float>();
  return inverse.allFinite() && origin.allFinite();
}

void addInstance(RTCDeviceTy* device, RTCSceneTy* scene, unsigned number,
                 RTCSceneTy* instancedScene, const Eigen::Affine3d& sceneFromInstance) {
  const Eigen::Matrix<float, 3, 4, Eigen::RowMajor> transform =
      sceneFromInstance.matrix().topRows<3>().cast<float>();
  const RTCGeometry instance = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_INSTANCE);
  rtcSetGeometryInstancedScene(instance, instancedScene);
  rtcSetGeometryTransform(instance, 0, RTC_FORMAT_FLOAT3X4_ROW_MAJOR, transform.data());
  rtcCommitGeometry(instance);
  rtcAttachGeometryByID(scene, instance, number);
  rtcReleaseGeometry(instance);
}

void commitScene(RTCDeviceTy* device, RTCSceneTy* scene) {
  rtcCommitScene(scene);
  throwIfEmbreeFailed(device, "building the tree of a scene");
}

RTCSceneTy* MeshTrees::findOrBuild(const Mesh& mesh, bool masked) {
  if (const auto found = trees_.find(&mesh); found != trees_.end()) return found->second.get();
  EmbreeScene tree = buildTriangleTree(device(), mesh.positions, mesh.indices, masked);
  ++built_;
  return (trees_[&mesh] = std::move(tree)).get();
}

}  // namespace enfilade::scene
