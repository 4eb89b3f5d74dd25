// Which device draws.
#pragma once

#include <string>
#include <vector>

namespace enfilade::render {

struct DeviceChoice {
  /// "": the best that gives a context, hardware before software. Else an index of the list that
  /// `enfilade doctor` prints, a part of a device's name (any case), or a UUID.
  std::string device;
  bool requireGpu = false;  ///< a device that draws on the CPU is refused
};

/// What came of trying one EGL device or platform.
struct DeviceTrial {
  std::string place;      ///< "EGL device 0", "EGL surfaceless platform"
  std::string name;       ///< GL_RENDERER, or what EGL calls it; may be empty
  std::string vendor;     ///< EGL_VENDOR; may be empty
  std::string glVersion;  ///< empty when there is no context
  std::string uuid;       ///< as 8-4-4-4-12 hexadecimal digits; empty where the driver tells none
  bool software = false;  ///< draws on the CPU
  std::string failure;    ///< why it gives no OpenGL 4.5 core context; empty: it does
};

struct DeviceReport {
  std::string clientExtensions;  ///< of EGL itself
  std::string failure;           ///< why there is no EGL to ask; empty: there is
  std::vector<DeviceTrial> devices;
};

}  // namespace enfilade::render
