// Owners of what Embree makes, and how a tree over triangles is made. No header of Embree needed.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <string>

struct RTCDeviceTy;
struct RTCGeometryTy;
struct RTCSceneTy;
struct RTCFilterFunctionNArguments;

namespace enfilade::render {

struct EmbreeRelease {
  void operator()(RTCDeviceTy* device) const;
  void operator()(RTCSceneTy* scene) const;
};
using EmbreeDevice = std::unique_ptr<RTCDeviceTy, EmbreeRelease>;
using EmbreeScene = std::unique_ptr<RTCSceneTy, EmbreeRelease>;

/// Builds with one thread, so that the tree, and so which of two equally near triangles is met
/// first, depends on nothing else. Throws RenderError.
EmbreeDevice newEmbreeDevice();
std::string embreeName();  ///< "Embree 3.13.5"

/// Robust: no ray slips through between two triangles. Otherwise some do, a fifth faster.
EmbreeScene newEmbreeScene(RTCDeviceTy* device, bool robust);

/// Decides for each ray of a packet whether it meets a triangle; see RTCFilterFunctionN.
using EmbreeFilter = void (*)(const RTCFilterFunctionNArguments*);

/// Triangles that are being written, in memory that Embree keeps: nothing is held twice.
struct OpenTriangles {
  RTCGeometryTy* geometry;
  Eigen::Vector3f* positions;
  std::uint32_t* corners;  ///< three a triangle
};
OpenTriangles openTriangles(RTCDeviceTy* device, std::size_t positions, std::size_t triangles);
/// Hands them to `scene` as geometry `number`. `filter` may be null.
void closeTriangles(const OpenTriangles& open, RTCSceneTy* scene, unsigned number,
                    EmbreeFilter filter);

/// Places `what` in `scene` as instance `number`.
void addInstance(RTCDeviceTy* device, RTCSceneTy* scene, unsigned number, RTCSceneTy* what,
                 const Eigen::Matrix<float, 3, 4, Eigen::RowMajor>& sceneFromWhat);

/// Throws RenderError, or std::bad_alloc, when anything failed since the last commit.
void commit(RTCDeviceTy* device, RTCSceneTy* scene);

}  // namespace enfilade::render
