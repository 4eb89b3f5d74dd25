// A GL 4.5 core context without a window. Only this file uses EGL.
#pragma once

#include <string>

#include "render/device.hpp"

namespace enfilade::render {

/// Move-only owner of one context.
class EglContext {
 public:
  /// Creates a context on the chosen device and makes it current. Order: EGL hardware devices, EGL
  /// devices that draw on the CPU, Mesa's surfaceless platform. Throws RenderError with a list of
  /// all attempts.
  explicit EglContext(const DeviceChoice& choice = {});
  ~EglContext();
  EglContext(EglContext&& other) noexcept;
  EglContext& operator=(EglContext&& other) noexcept;

  /// Throws RenderError if the context is current on another thread.
  void makeCurrent() const;

  const std::string& deviceName() const { return deviceName_; }  ///< GL_RENDERER
  bool software() const { return software_; }
  /// One sentence about hardware devices that failed before this one; may be empty.
  const std::string& warning() const { return warning_; }

 private:
  void release() noexcept;

  void* display_ = nullptr;  ///< EGLDisplay; shared with other contexts, never terminated
  void* context_ = nullptr;  ///< EGLContext
  std::string deviceName_;
  std::string warning_;
  bool software_ = false;
};

/// Counts the devices, in the order in which they are tried. Never throws.
DeviceList listDevices();

/// Creates a context on a device of the list, and destroys it. Never throws.
DeviceProbe probeDevice(std::size_t index);

}  // namespace enfilade::render
