// Selection and probing of rendering devices.
#pragma once

#include <cstddef>
#include <string>

namespace enfilade::render {

/// Source of Frame::depth in the OpenGL renderer.
enum class DepthSource {
  automatic,  ///< plane on a GPU, buffer on a CPU
  buffer,     ///< the depth buffer
  plane       ///< the plane of each triangle, at the pixel's centre
};

/// The requested device.
struct DeviceChoice {
  /// "": the first device with a context, hardware before software. Otherwise an index into the
  /// list of `enfilade doctor`, a part of a device name (case-insensitive), or a UUID.
  std::string device;
  bool requireGpu = false;  ///< rejects devices that draw on the CPU
  DepthSource depthSource = DepthSource::automatic;
  /// Rounds vertices to 1/256 pixel in the shader, as GPUs do; for tests on a CPU.
  bool roundsVertices = false;
};

/// The result of probing one EGL device or platform.
struct DeviceProbe {
  std::string platform;   ///< "EGL device 0", "EGL surfaceless platform"
  std::string name;       ///< GL_RENDERER, otherwise EGL's name; may be empty
  std::string vendor;     ///< EGL_VENDOR; may be empty
  std::string glVersion;  ///< empty without a context
  std::string uuid;       ///< 8-4-4-4-12 hexadecimal digits; empty if the driver reports none
  bool software = false;  ///< draws on the CPU
  std::string failure;    ///< reason for no OpenGL 4.5 core context; empty: usable
};

/// The devices of this machine, in the order of the indices of `DeviceChoice::device`.
struct DeviceList {
  std::size_t count = 0;
  std::string failure;  ///< reason why EGL has no devices; empty: it has
};

}  // namespace enfilade::render
