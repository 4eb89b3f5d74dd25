#include "render/raytrace/embree.hpp"

#include <embree3/rtcore.h>

#include <new>

#include "render/render_error.hpp"

namespace enfilade::render {
namespace {

void throwIfFailed(RTCDevice device, const char* doing) {
  const RTCError error = rtcGetDeviceError(device);
  if (error == RTC_ERROR_NONE) return;
  if (error == RTC_ERROR_OUT_OF_MEMORY) throw std::bad_alloc();
  throw RenderError(std::string("Embree failed with error ") + std::to_string(error) + " while " +
                    doing);
}

}  // namespace

void EmbreeRelease::operator()(RTCDeviceTy* device) const {
  rtcReleaseDevice(device);
}
void EmbreeRelease::operator()(RTCSceneTy* scene) const {
  rtcReleaseScene(scene);
}

EmbreeDevice newEmbreeDevice() {
  EmbreeDevice device(rtcNewDevice("threads=1,set_affinity=0"));
  if (!device) {
    throw RenderError("Embree gives no device: error " +
                      std::to_string(rtcGetDeviceError(nullptr)));
  }
  return device;
}

std::string embreeName() {
  return "Embree " RTC_VERSION_STRING;
}

EmbreeScene newEmbreeScene(RTCDeviceTy* device, bool robust) {
  EmbreeScene scene(rtcNewScene(device));
  const auto flags = RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION |
                     (robust ? RTC_SCENE_FLAG_ROBUST : RTC_SCENE_FLAG_NONE);
  rtcSetSceneFlags(scene.get(), static_cast<RTCSceneFlags>(flags));
  rtcSetSceneBuildQuality(scene.get(), RTC_BUILD_QUALITY_MEDIUM);
  return scene;
}

OpenTriangles openTriangles(RTCDeviceTy* device, std::size_t positions, std::size_t triangles) {
  const RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  OpenTriangles open{geometry, nullptr, nullptr};
  open.positions = static_cast<Eigen::Vector3f*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(Eigen::Vector3f), positions));
  open.corners = static_cast<std::uint32_t*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(std::uint32_t), triangles));
  if (!open.positions || !open.corners) {
    rtcReleaseGeometry(geometry);
    throwIfFailed(device, "making room for triangles");
    throw std::bad_alloc();
  }
  return open;
}

void closeTriangles(const OpenTriangles& open, RTCSceneTy* scene, unsigned number,
                    EmbreeFilter filter) {
  if (filter) {
    rtcSetGeometryIntersectFilterFunction(open.geometry, filter);
    rtcSetGeometryOccludedFilterFunction(open.geometry, filter);
  }
  rtcCommitGeometry(open.geometry);
  rtcAttachGeometryByID(scene, open.geometry, number);
  rtcReleaseGeometry(open.geometry);
}

void addInstance(RTCDeviceTy* device, RTCSceneTy* scene, unsigned number, RTCSceneTy* what,
                 const Eigen::Matrix<float, 3, 4, Eigen::RowMajor>& sceneFromWhat) {
  const RTCGeometry instance = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_INSTANCE);
  rtcSetGeometryInstancedScene(instance, what);
  rtcSetGeometryTransform(instance, 0, RTC_FORMAT_FLOAT3X4_ROW_MAJOR, sceneFromWhat.data());
  rtcCommitGeometry(instance);
  rtcAttachGeometryByID(scene, instance, number);
  rtcReleaseGeometry(instance);
}

void commit(RTCDeviceTy* device, RTCSceneTy* scene) {
  rtcCommitScene(scene);
  throwIfFailed(device, "building the tree of a scene");
}

}  // namespace enfilade::render
