#include "render/gl/egl_context.hpp"

#include <dlfcn.h>
#include <epoxy/egl.h>
#include <epoxy/gl.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <mutex>
#include <sstream>
#include <utility>
#include <vector>

#include "render/render_error.hpp"
#include "scene/model/ascii.hpp"

namespace enfilade::render {
namespace {

constexpr int kMaxDevices = 32;
constexpr EGLint kEglRenderer = 0x335F;  // EGL_RENDERER_EXT of EGL_EXT_device_query_name

struct DisplayCandidate {
  EGLDisplay display = EGL_NO_DISPLAY;
  std::string platform;
  std::string name;    // EGL's name; may be empty
  bool onCpu = false;  // according to EGL
};

std::string describeEglError(const char* call) {
  std::array<char, 16> code{};
  std::snprintf(code.data(), code.size(), "0x%04x", static_cast<unsigned>(eglGetError()));
  return std::string(call) + " failed (EGL error " + code.data() + ")";
}

/// Compares whole words: EGL_EXT_device must not match EGL_EXT_device_base.
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

std::string toStringOrEmpty(const char* text) {
  return text ? text : "";
}

std::string toStringOrEmpty(const GLubyte* text) {
  return text ? reinterpret_cast<const char*>(text) : "";
}

/// EGL's name of a device, or "".
std::string queryDeviceName(EGLDeviceEXT device, const char* extensions) {
  if (!hasExtension(extensions, "EGL_EXT_device_query_name")) return "";
  return toStringOrEmpty(eglQueryDeviceStringEXT(device, kEglRenderer));
}

/// One display per device, devices that draw on the CPU last.
std::vector<DisplayCandidate> enumerateDeviceDisplays(const char* clientExtensions) {
  const bool enumerates = hasExtension(clientExtensions, "EGL_EXT_device_base") ||
                          hasExtension(clientExtensions, "EGL_EXT_device_enumeration");
  if (!enumerates || !hasExtension(clientExtensions, "EGL_EXT_platform_device")) return {};
  std::array<EGLDeviceEXT, kMaxDevices> devices{};
  EGLint count = 0;
  if (!eglQueryDevicesEXT(kMaxDevices, devices.data(), &count)) return {};
  std::vector<DisplayCandidate> hardware, software;
  for (EGLint i = 0; i < count; ++i) {
    const auto device = devices[static_cast<std::size_t>(i)];
    const char* extensions = eglQueryDeviceStringEXT(device, EGL_EXTENSIONS);
    const bool onCpu = hasExtension(extensions, "EGL_MESA_device_software");
    (onCpu ? software : hardware)
        .push_back({eglGetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, device, nullptr),
                    "EGL device " + std::to_string(i), queryDeviceName(device, extensions), onCpu});
  }
  hardware.insert(hardware.end(), software.begin(), software.end());
  return hardware;
}

std::vector<DisplayCandidate> enumerateDisplays(const char* extensions) {
  if (!hasExtension(extensions, "EGL_EXT_platform_base")) return {};
  std::vector<DisplayCandidate> result = enumerateDeviceDisplays(extensions);
  if (hasExtension(extensions, "EGL_MESA_platform_surfaceless")) {
    result.push_back(
        {eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr),
         "EGL surfaceless platform", "", true});
  }
  return result;
}

/// Creates a current context on `display`; on failure EGL_NO_CONTEXT, with the reason in `failure`.
EGLContext createCurrentContext(EGLDisplay display, std::string& failure) {
  const auto fail = [&](const std::string& reason) {
    failure = reason;
    return EGLContext{EGL_NO_CONTEXT};
  };
  if (display == EGL_NO_DISPLAY) return fail(describeEglError("eglGetPlatformDisplayEXT"));
  if (!eglInitialize(display, nullptr, nullptr)) return fail(describeEglError("eglInitialize"));
  const char* extensions = eglQueryString(display, EGL_EXTENSIONS);
  for (const char* needed : {"EGL_KHR_no_config_context", "EGL_KHR_surfaceless_context"}) {
    if (!hasExtension(extensions, needed)) return fail(std::string("has no ") + needed);
  }
  if (!eglBindAPI(EGL_OPENGL_API)) return fail(describeEglError("eglBindAPI(EGL_OPENGL_API)"));
  constexpr std::array<EGLint, 7> kAttributes{EGL_CONTEXT_MAJOR_VERSION,
                                              4,
                                              EGL_CONTEXT_MINOR_VERSION,
                                              5,
                                              EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                              EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                              EGL_NONE};
  const EGLContext context =
      eglCreateContext(display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, kAttributes.data());
  if (context == EGL_NO_CONTEXT) return fail(describeEglError("eglCreateContext(OpenGL 4.5 core)"));
  if (!eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context)) {
    const std::string reason = describeEglError("eglMakeCurrent");
    eglDestroyContext(display, context);
    return fail(reason);
  }
  return context;
}

/// UUID of the current context's device; empty if the driver reports none.
std::string queryCurrentUuid() {
  if (!epoxy_has_gl_extension("GL_EXT_memory_object")) return "";
  GLint count = 0;
  glGetIntegerv(GL_NUM_DEVICE_UUIDS_EXT, &count);
  if (count < 1) return "";
  std::array<GLubyte, GL_UUID_SIZE_EXT> bytes{};
  glGetUnsignedBytei_vEXT(GL_DEVICE_UUID_EXT, 0, bytes.data());
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    std::array<char, 3> digits{};
    std::snprintf(digits.data(), digits.size(), "%02x", unsigned{bytes[i]});
    if (i == 4 || i == 6 || i == 8 || i == 10) text += '-';
    text += digits.data();
  }
  return text;
}

void destroyContext(EGLDisplay display, EGLContext context) noexcept {
  if (eglGetCurrentContext() == context) {
    eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  }
  eglDestroyContext(display, context);
}

/// Serialises device probing. Displays are shared by the process, and Mesa's eglInitialize
/// overwrites data that another thread may be reading. ThreadSanitizer does not recognise Mesa's
/// futex locks.
std::mutex& getDeviceProbeMutex() {
  static std::mutex mutex;
  return mutex;
}

/// Creates a current context on a device and fills `probe` about it; EGL_NO_CONTEXT on failure.
EGLContext openDevice(const DisplayCandidate& candidate, DeviceProbe& probe) {
  probe.platform = candidate.platform;
  probe.name = candidate.name;
  probe.software = candidate.onCpu;
  const EGLContext context = createCurrentContext(candidate.display, probe.failure);
  if (context == EGL_NO_CONTEXT) return context;
  probe.vendor = toStringOrEmpty(eglQueryString(candidate.display, EGL_VENDOR));
  probe.name = toStringOrEmpty(glGetString(GL_RENDERER));
  probe.glVersion = toStringOrEmpty(glGetString(GL_VERSION));
  probe.software = isSoftwareName(probe.name);
  probe.uuid = queryCurrentUuid();
  return context;
}

bool isNumber(const std::string& text) {
  return !text.empty() && text.size() < 4 &&
         std::all_of(text.begin(), text.end(), [](char c) { return c >= '0' && c <= '9'; });
}

/// The reason why the device is not even tried: another one is chosen by its number.
std::string explainOtherNumber(const DeviceChoice& choice, std::size_t index) {
  const bool isOther = isNumber(choice.device) && std::stoul(choice.device) != index;
  return isOther ? "is not number " + choice.device : "";
}

/// The reason why the device does not match `choice`; empty: it matches.
std::string explainRejection(const DeviceChoice& choice, const DeviceProbe& probe) {
  if (choice.requireGpu && probe.software) return "draws on the CPU, but a GPU is required";
  const std::string wanted = scene::toLowerCase(choice.device);
  if (wanted.empty() || isNumber(wanted)) return "";
  const std::string uuid = scene::toLowerCase(probe.uuid);
  const bool byUuid = !uuid.empty() && (wanted == uuid || wanted == "gpu-" + uuid);
  if (byUuid || scene::toLowerCase(probe.name).find(wanted) != std::string::npos) return "";
  return "is named \"" + probe.name + "\", not \"" + choice.device + "\"";
}

std::string formatProbeLine(std::size_t index, const std::string& platform,
                            const std::string& reason) {
  return "\n  " + std::to_string(index) + ": " + platform + ": " + reason;
}

/// A missing library, or "". libepoxy loads them on first use and aborts the program if one is
/// missing.
std::string findMissingLibrary() {
  const auto loads = [](const char* name) {
    return dlopen(name, RTLD_LAZY | RTLD_LOCAL) != nullptr;
  };
  if (!loads("libEGL.so.1")) {
    return "libEGL.so.1 cannot be loaded; install the package libegl1";
  }
  if (!loads("libOpenGL.so.0") && !loads("libGL.so.1")) {
    return "neither libOpenGL.so.0 nor libGL.so.1 can be loaded; install the package libopengl0";
  }
  return "";
}

constexpr const char* kNoPlatform =
    "EGL offers neither EGL_EXT_platform_device nor EGL_MESA_platform_surfaceless";

}  // namespace

EglContext::EglContext(const DeviceChoice& choice) {
  if (const std::string missing = findMissingLibrary(); !missing.empty())
    throw RenderError(missing);
  const std::lock_guard lock(getDeviceProbeMutex());
  std::string tried, hardwareFailures;
  const std::vector<DisplayCandidate> all =
      enumerateDisplays(eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS));
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (const std::string reason = explainOtherNumber(choice, i); !reason.empty()) {
      tried += formatProbeLine(i, all[i].platform, reason);
      continue;
    }
    DeviceProbe probe;
    const EGLContext context = openDevice(all[i], probe);
    const std::string reason =
        probe.failure.empty() ? explainRejection(choice, probe) : probe.failure;
    if (reason.empty()) {
      display_ = all[i].display;
      context_ = context;
      deviceName_ = probe.name;
      software_ = probe.software;
      if (software_ && !hardwareFailures.empty()) {
        warning_ = "drawing on the CPU with " + deviceName_ +
                   ", because no GPU is usable:" + hardwareFailures;
      }
      return;
    }
    if (context != EGL_NO_CONTEXT) destroyContext(all[i].display, context);
    tried += formatProbeLine(i, probe.platform, reason);
    if (!probe.software && !probe.failure.empty())
      hardwareFailures += formatProbeLine(i, probe.platform, reason);
  }
  if (tried.empty()) tried.append("\n  ").append(kNoPlatform);
  std::string wanted = choice.device.empty() ? "" : " \"" + choice.device + "\"";
  if (choice.requireGpu) wanted += " that is a GPU";
  throw RenderError("no EGL device" + wanted + " gives an OpenGL 4.5 core context:" + tried +
                    "\nrun `enfilade doctor` for details; drawing on the CPU needs the packages "
                    "libegl-mesa0 and libgl1-mesa-dri");
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
  warning_ = std::move(other.warning_);
  software_ = other.software_;
  return *this;
}

void EglContext::makeCurrent() const {
  // The bound API is per thread.
  if (!eglBindAPI(EGL_OPENGL_API) ||
      !eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_)) {
    throw RenderError(describeEglError("eglMakeCurrent") +
                      "; create, use and destroy a GlRenderer on the same thread");
  }
}

void EglContext::release() noexcept {
  // Terminating the display would end the contexts of other renderers too.
  if (context_) destroyContext(display_, context_);
  context_ = nullptr;
}

DeviceList listDevices() {
  DeviceList list{0, findMissingLibrary()};
  if (!list.failure.empty()) return list;
  const std::lock_guard lock(getDeviceProbeMutex());
  list.count = enumerateDisplays(eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS)).size();
  if (list.count == 0) list.failure = kNoPlatform;
  return list;
}

DeviceProbe probeDevice(std::size_t index) {
  DeviceProbe probe;
  probe.failure = findMissingLibrary();
  if (!probe.failure.empty()) return probe;
  const std::lock_guard lock(getDeviceProbeMutex());
  const auto all = enumerateDisplays(eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS));
  if (index >= all.size()) {
    probe.failure = "there is no device " + std::to_string(index);
    return probe;
  }
  const EGLContext context = openDevice(all[index], probe);
  if (context != EGL_NO_CONTEXT) destroyContext(all[index].display, context);
  return probe;
}

}  // namespace enfilade::render
