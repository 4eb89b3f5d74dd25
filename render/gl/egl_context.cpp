#include "render/gl/egl_context.hpp"

#include <epoxy/egl.h>
#include <epoxy/gl.h>

#include <array>
#include <cstdio>
#include <sstream>
#include <utility>
#include <vector>

#include "render/render_error.hpp"

namespace enfilade::render {
namespace {

constexpr int kMostDevices = 32;

struct Candidate {
  EGLDisplay display = EGL_NO_DISPLAY;
  std::string name;
};

std::string eglFailure(const char* call) {
  std::array<char, 16> code{};
  std::snprintf(code.data(), code.size(), "0x%04x", static_cast<unsigned>(eglGetError()));
  return std::string(call) + " failed (EGL error " + code.data() + ")";
}

/// Whole words only: EGL_EXT_device must not be found in EGL_EXT_device_base.
bool hasExtension(const char* list, const std::string& wanted) {
  std::istringstream words(list ? list : "");
  for (std::string word; words >> word;) {
    if (word == wanted) return true;
  }
  return false;
}

bool isSoftwareName(const std::string& name) {
  for (const char* known : {"llvmpipe", "softpipe", "swrast"}) {
    if (name.find(known) != std::string::npos) return true;
  }
  return false;
}

/// One display a device, devices that draw on the CPU last.
std::vector<Candidate> deviceDisplays(const char* clientExtensions) {
  if (!hasExtension(clientExtensions, "EGL_EXT_platform_device")) return {};
  std::array<EGLDeviceEXT, kMostDevices> devices{};
  EGLint count = 0;
  if (!eglQueryDevicesEXT(kMostDevices, devices.data(), &count)) return {};
  std::vector<Candidate> hardware, software;
  for (EGLint i = 0; i < count; ++i) {
    const auto device = devices[static_cast<std::size_t>(i)];
    const bool onCpu =
        hasExtension(eglQueryDeviceStringEXT(device, EGL_EXTENSIONS), "EGL_MESA_device_software");
    (onCpu ? software : hardware)
        .push_back({eglGetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, device, nullptr),
                    "EGL device " + std::to_string(i)});
  }
  hardware.insert(hardware.end(), software.begin(), software.end());
  return hardware;
}

std::vector<Candidate> candidates() {
  const char* extensions = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
  if (!hasExtension(extensions, "EGL_EXT_platform_base")) return {};
  std::vector<Candidate> result = deviceDisplays(extensions);
  if (hasExtension(extensions, "EGL_MESA_platform_surfaceless")) {
    result.push_back(
        {eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr),
         "EGL surfaceless platform"});
  }
  return result;
}

/// A current context on `display`, or EGL_NO_CONTEXT and why in `failure`.
EGLContext currentContextOn(EGLDisplay display, std::string& failure) {
  const auto fail = [&](const std::string& why) {
    failure = why;
    return EGLContext{EGL_NO_CONTEXT};
  };
  if (display == EGL_NO_DISPLAY) return fail(eglFailure("eglGetPlatformDisplayEXT"));
  if (!eglInitialize(display, nullptr, nullptr)) return fail(eglFailure("eglInitialize"));
  const char* extensions = eglQueryString(display, EGL_EXTENSIONS);
  for (const char* needed : {"EGL_KHR_no_config_context", "EGL_KHR_surfaceless_context"}) {
    if (!hasExtension(extensions, needed)) return fail(std::string("has no ") + needed);
  }
  if (!eglBindAPI(EGL_OPENGL_API)) return fail(eglFailure("eglBindAPI(EGL_OPENGL_API)"));
  constexpr std::array<EGLint, 7> kAttributes{EGL_CONTEXT_MAJOR_VERSION,
                                              4,
                                              EGL_CONTEXT_MINOR_VERSION,
                                              5,
                                              EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                              EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                              EGL_NONE};
  const EGLContext context =
      eglCreateContext(display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, kAttributes.data());
  if (context == EGL_NO_CONTEXT) return fail(eglFailure("eglCreateContext(OpenGL 4.5 core)"));
  if (!eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context)) {
    const std::string why = eglFailure("eglMakeCurrent");
    eglDestroyContext(display, context);
    return fail(why);
  }
  return context;
}

}  // namespace

EglContext::EglContext() {
  std::string tried;
  for (const Candidate& candidate : candidates()) {
    std::string failure;
    const EGLContext context = currentContextOn(candidate.display, failure);
    if (context != EGL_NO_CONTEXT) {
      display_ = candidate.display;
      context_ = context;
      const auto* name = glGetString(GL_RENDERER);
      deviceName_ = name ? reinterpret_cast<const char*>(name) : "unknown";
      software_ = isSoftwareName(deviceName_);
      return;
    }
    tried += "\n  " + candidate.name + ": " + failure;
  }
  if (tried.empty()) {
    tried = "\n  EGL offers neither EGL_EXT_platform_device nor EGL_MESA_platform_surfaceless";
  }
  throw RenderError("no EGL device gives an OpenGL 4.5 core context:" + tried +
                    "\ninstall a driver; drawing on the CPU needs the packages libegl-mesa0 and "
                    "libgl1-mesa-dri");
}

EglContext::~EglContext() {
  release();
}

EglContext::EglContext(EglContext&& other) noexcept {
  *this = std::move(other);
}

EglContext& EglContext::operator=(EglContext&& other) noexcept {
  if (this == &other) return *this;
  release();
  display_ = std::exchange(other.display_, nullptr);
  context_ = std::exchange(other.context_, nullptr);
  deviceName_ = std::move(other.deviceName_);
  software_ = other.software_;
  return *this;
}

void EglContext::makeCurrent() const {
  // The API bound is a matter of each thread.
  if (!eglBindAPI(EGL_OPENGL_API) ||
      !eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_)) {
    throw RenderError(eglFailure("eglMakeCurrent") +
                      "; a GlRenderer must be made, used and destroyed on one thread");
  }
}

void EglContext::release() noexcept {
  if (!context_) return;
  // Terminating the display would end the contexts of other Renderers too.
  if (eglGetCurrentContext() == context_) {
    eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  }
  eglDestroyContext(display_, context_);
  context_ = nullptr;
}

}  // namespace enfilade::render
