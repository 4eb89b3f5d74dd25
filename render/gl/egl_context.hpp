// A GL 4.5 core context without a window. The only place that speaks EGL.
#pragma once

#include <string>

namespace enfilade::render {

/// Move-only owner of one context. The best device that gives one is taken: EGL devices with
/// hardware first, then Mesa's surfaceless platform, which draws on the CPU.
class EglContext {
 public:
  /// Makes the context and makes it current. Throws RenderError listing all that was tried.
  EglContext();
  ~EglContext();
  EglContext(EglContext&& other) noexcept;
  EglContext& operator=(EglContext&& other) noexcept;

  /// Throws RenderError when the context is current on another thread.
  void makeCurrent() const;

  const std::string& deviceName() const { return deviceName_; }  ///< GL_RENDERER
  bool software() const { return software_; }

 private:
  void release() noexcept;

  void* display_ = nullptr;  ///< EGLDisplay; shared with other contexts, never terminated
  void* context_ = nullptr;  ///< EGLContext
  std::string deviceName_;
  bool software_ = false;
};

}  // namespace enfilade::render
