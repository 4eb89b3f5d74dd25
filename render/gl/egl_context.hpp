// A GL 4.5 core context without a window. The only place that speaks EGL.
#pragma once

#include <string>
#include <vector>

#include "render/device.hpp"

namespace enfilade::render {

/// Move-only owner of one context.
class EglContext {
 public:
  /// Makes a context on the device chosen and makes it current: EGL devices with hardware first,
  /// then those that draw on the CPU, then Mesa's surfaceless platform. Throws RenderError listing
  /// all that was tried.
  explicit EglContext(const DeviceChoice& choice = {});
  ~EglContext();
  EglContext(EglContext&& other) noexcept;
  EglContext& operator=(EglContext&& other) noexcept;

  /// Throws RenderError when the context is current on another thread.
  void makeCurrent() const;

  const std::string& deviceName() const { return deviceName_; }  ///< GL_RENDERER
  bool software() const { return software_; }
  /// What was tried before in vain, one sentence; empty when nothing was.
  const std::string& note() const { return note_; }

 private:
  void release() noexcept;

  void* display_ = nullptr;  ///< EGLDisplay; shared with other contexts, never terminated
  void* context_ = nullptr;  ///< EGLContext
  std::string deviceName_;
  std::string note_;
  bool software_ = false;
};

/// Tries each device in the order in which `DeviceChoice::device` counts them. Never throws: a
/// machine without EGL has none, and why.
DeviceReport tryDevices();

}  // namespace enfilade::render
