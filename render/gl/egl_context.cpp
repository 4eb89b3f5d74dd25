#include "render/gl/egl_context.hpp"

#include <dlfcn.h>
#include <epoxy/egl.h>
#include <epoxy/gl.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdio>
#include <mutex>
#include <sstream>
#include <utility>
#include <vector>

#include "render/render_error.hpp"

namespace enfilade::render {
namespace {

constexpr int kMostDevices = 32;
constexpr EGLint kEglRenderer = 0x335F;  // EGL_RENDERER_EXT of EGL_EXT_device_query_name

struct Candidate {
  EGLDisplay display = EGL_NO_DISPLAY;
  std::string place;
  std::string name;    // what EGL calls it; may be empty
  bool onCpu = false;  // EGL says so
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

std::string textOf(const char* text) {
  return text ? text : "";
}

std::string textOf(const GLubyte* text) {
  return text ? reinterpret_cast<const char*>(text) : "";
}

/// What EGL calls a device, or nothing.
std::string nameOf(EGLDeviceEXT device, const char* extensions) {
  if (!hasExtension(extensions, "EGL_EXT_device_query_name")) return "";
  return textOf(eglQueryDeviceStringEXT(device, kEglRenderer));
}

/// One display a device, devices that draw on the CPU last.
std::vector<Candidate> deviceDisplays(const char* clientExtensions) {
  const bool enumerates = hasExtension(clientExtensions, "EGL_EXT_device_base") ||
                          hasExtension(clientExtensions, "EGL_EXT_device_enumeration");
  if (!enumerates || !hasExtension(clientExtensions, "EGL_EXT_platform_device")) return {};
  std::array<EGLDeviceEXT, kMostDevices> devices{};
  EGLint count = 0;
  if (!eglQueryDevicesEXT(kMostDevices, devices.data(), &count)) return {};
  std::vector<Candidate> hardware, software;
  for (EGLint i = 0; i < count; ++i) {
    const auto device = devices[static_cast<std::size_t>(i)];
    const char* extensions = eglQueryDeviceStringEXT(device, EGL_EXTENSIONS);
    const bool onCpu = hasExtension(extensions, "EGL_MESA_device_software");
    (onCpu ? software : hardware)
        .push_back({eglGetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, device, nullptr),
                    "EGL device " + std::to_string(i), nameOf(device, extensions), onCpu});
  }
  hardware.insert(hardware.end(), software.begin(), software.end());
  return hardware;
}

std::vector<Candidate> candidates(const char* extensions) {
  if (!hasExtension(extensions, "EGL_EXT_platform_base")) return {};
  std::vector<Candidate> result = deviceDisplays(extensions);
  if (hasExtension(extensions, "EGL_MESA_platform_surfaceless")) {
    result.push_back(
        {eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr),
         "EGL surfaceless platform", "", true});
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

/// Of the current context's device; empty where the driver tells none.
std::string currentUuid() {
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

void destroy(EGLDisplay display, EGLContext context) noexcept {
  if (eglGetCurrentContext() == context) {
    eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  }
  eglDestroyContext(display, context);
}

/// One thread at a time looks for a device: displays are the process's, Mesa's eglInitialize writes
/// anew what another thread may be reading of one, and its own locks, of futexes, are unknown to
/// ThreadSanitizer.
std::mutex& lookingForDevice() {
  static std::mutex mutex;
  return mutex;
}

/// A current context and what it says of itself; EGL_NO_CONTEXT when there is a failure.
EGLContext tryDevice(const Candidate& candidate, DeviceTrial& trial) {
  trial.place = candidate.place;
  trial.name = candidate.name;
  trial.software = candidate.onCpu;
  const EGLContext context = currentContextOn(candidate.display, trial.failure);
  if (context == EGL_NO_CONTEXT) return context;
  trial.vendor = textOf(eglQueryString(candidate.display, EGL_VENDOR));
  trial.name = textOf(glGetString(GL_RENDERER));
  trial.glVersion = textOf(glGetString(GL_VERSION));
  trial.software = isSoftwareName(trial.name);
  trial.uuid = currentUuid();
  return context;
}

std::string lowered(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

bool isNumber(const std::string& text) {
  return !text.empty() && text.size() < 4 &&
         std::all_of(text.begin(), text.end(), [](char c) { return c >= '0' && c <= '9'; });
}

/// Why the device is not the one that was asked for; empty: it is.
std::string whyNot(const DeviceChoice& choice, std::size_t index, const DeviceTrial& trial) {
  if (choice.requireGpu && trial.software) return "draws on the CPU, and a GPU is required";
  const std::string wanted = lowered(choice.device);
  if (wanted.empty()) return "";
  if (isNumber(wanted)) return std::stoul(wanted) == index ? "" : "is not number " + wanted;
  const std::string uuid = lowered(trial.uuid);
  const bool byUuid = !uuid.empty() && (wanted == uuid || wanted == "gpu-" + uuid);
  if (byUuid || lowered(trial.name).find(wanted) != std::string::npos) return "";
  return "is called \"" + trial.name + "\", not \"" + choice.device + "\"";
}

std::string line(std::size_t index, const DeviceTrial& trial, const std::string& why) {
  return "\n  " + std::to_string(index) + ": " + trial.place + ": " + why;
}

/// libepoxy loads these when they are first needed, and ends the program when they are not there.
std::string missingLibrary() {
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
  if (const std::string missing = missingLibrary(); !missing.empty()) throw RenderError(missing);
  const std::lock_guard lock(lookingForDevice());
  std::string tried, hardwareFailures;
  const std::vector<Candidate> all = candidates(eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS));
  for (std::size_t i = 0; i < all.size(); ++i) {
    DeviceTrial trial;
    const EGLContext context = tryDevice(all[i], trial);
    const std::string why = trial.failure.empty() ? whyNot(choice, i, trial) : trial.failure;
    if (why.empty()) {
      display_ = all[i].display;
      context_ = context;
      deviceName_ = trial.name;
      software_ = trial.software;
      if (software_ && !hardwareFailures.empty()) {
        note_ = "drawing on the CPU with " + deviceName_ +
                ", since no GPU can be used:" + hardwareFailures;
      }
      return;
    }
    if (context != EGL_NO_CONTEXT) destroy(all[i].display, context);
    tried += line(i, trial, why);
    if (!trial.software && !trial.failure.empty()) hardwareFailures += line(i, trial, why);
  }
  if (tried.empty()) tried.append("\n  ").append(kNoPlatform);
  std::string wanted = choice.device.empty() ? "" : " \"" + choice.device + "\"";
  if (choice.requireGpu) wanted += " that is a GPU";
  throw RenderError("no EGL device" + wanted + " gives an OpenGL 4.5 core context:" + tried +
                    "\n`enfilade doctor` tells more; drawing on the CPU needs the packages "
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
  note_ = std::move(other.note_);
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
  // Terminating the display would end the contexts of other renderers too.
  if (context_) destroy(display_, context_);
  context_ = nullptr;
}

DeviceReport tryDevices() {
  DeviceReport report;
  report.failure = missingLibrary();
  if (!report.failure.empty()) return report;
  const std::lock_guard lock(lookingForDevice());
  const char* extensions = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
  report.clientExtensions = textOf(extensions);
  for (const Candidate& candidate : candidates(extensions)) {
    DeviceTrial& trial = report.devices.emplace_back();
    const EGLContext context = tryDevice(candidate, trial);
    if (context != EGL_NO_CONTEXT) destroy(candidate.display, context);
  }
  if (report.devices.empty()) report.failure = kNoPlatform;
  return report;
}

}  // namespace enfilade::render
