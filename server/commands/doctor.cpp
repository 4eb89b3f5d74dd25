#include "server/commands/doctor.hpp"

#include <fmt/core.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "render/gl/egl_context.hpp"
#include "render/gl/gl_renderer.hpp"
#include "render/image/image.hpp"
#include "server/base/standard_output.hpp"
#include "server/commands/child_call.hpp"
#include "server/commands/egl_vendors.hpp"
#include "server/commands/self_test_scene.hpp"

namespace enfilade::server {
namespace {

using Json = nlohmann::ordered_json;
using Clock = std::chrono::steady_clock;

constexpr int kWidth = 640, kHeight = 480;
constexpr const char* kRight = "right";  // a proof that succeeded
constexpr double kMeasureSeconds = 0.5;  // duration of the frame rate measurement

struct SelfTest {
  std::string failure;  ///< reason of the failure; empty: passed
  double framesPerSecond = 0;
  render::Frame frame;
};

double measureFps(render::GlRenderer& renderer) {
  const auto begin = Clock::now();
  int frames = 0;
  double seconds = 0;
  for (; seconds < kMeasureSeconds; ++frames) {
    renderer.render({}, makeSelfTestCamera(kWidth, kHeight));
    seconds = std::chrono::duration<double>(Clock::now() - begin).count();
  }
  return frames / seconds;
}

SelfTest runSelfTest(std::size_t device) {
  SelfTest selfTest;
  try {
    render::GlRenderer renderer(makeSelfTestScene(), {.device = std::to_string(device)});
    selfTest.frame = renderer.render({}, makeSelfTestCamera(kWidth, kHeight));
    selfTest.failure = validateSelfTestFrame(selfTest.frame);
    selfTest.framesPerSecond = measureFps(renderer);
  } catch (const render::RenderError& error) {
    selfTest.failure = error.what();
  }
  return selfTest;
}

/// Suggests the packages to install.
std::string suggestRemedy(const Json& devices, const std::string& failure, bool gpuWorks,
                          bool anyWorks) {
  if (devices.empty() && !failure.empty()) return failure;
  if (!anyWorks)
    return "to draw on the CPU install libegl-mesa0, libgl1-mesa-dri and libopengl0; for an "
           "NVIDIA GPU its driver with libEGL_nvidia (in a container: "
           "NVIDIA_DRIVER_CAPABILITIES=graphics)";
  if (!gpuWorks)
    return "no GPU can draw: install its vendor's EGL driver (NVIDIA: libnvidia-gl, in a container "
           "NVIDIA_DRIVER_CAPABILITIES=graphics; others: libgl1-mesa-dri and access to "
           "/dev/dri/renderD*)";
  return "";
}

Json toJson(const std::vector<EglVendor>& vendors) {
  Json all = Json::array();
  for (const EglVendor& vendor : vendors)
    all.push_back(
        {{"file", vendor.file}, {"library", vendor.library}, {"failure", vendor.failure}});
  return all;
}

Json toJson(std::size_t index, const render::DeviceProbe& probe, const SelfTest& selfTest) {
  return {{"index", index},
          {"place", probe.platform},
          {"name", probe.name},
          {"vendor", probe.vendor},
          {"gl", probe.glVersion},
          {"uuid", probe.uuid},
          {"software", probe.software},
          {"failure", probe.failure},
          {"proof",
           probe.failure.empty() ? (selfTest.failure.empty() ? kRight : selfTest.failure) : ""},
          {"frames_per_second", std::round(10 * selfTest.framesPerSecond) / 10}};
}

std::string dump(const Json& json, int indent) {
  return json.dump(indent, ' ', false, Json::error_handler_t::replace);
}

std::string getString(const Json& value) {
  return value.get<std::string>();
}

bool isRight(const Json& device) {
  return device["failure"] == "" && device["proof"] == kRight;
}

/// The devices that EGL lists, or how a driver ended the list: "crashed (..)".
struct ListedDevices {
  render::DeviceList list;
  std::string crash;
};

/// Lists the devices in a child process: a crash of a driver ends that alone.
ListedDevices listDevicesInChild() {
  const ChildAnswer answer = callInChild([](const Send& send) {
    const render::DeviceList list = render::listDevices();
    send(dump({{"count", list.count}, {"failure", list.failure}}, -1));
  });
  const Json list = Json::parse(answer.text, nullptr, false);
  if (!answer.failure.empty()) return {{}, answer.failure};
  if (list.is_discarded()) return {{}, "exited"};
  return {{list["count"].get<std::size_t>(), list["failure"].get<std::string>()}, ""};
}

/// Finds the vendor libraries that crash or hang while EGL lists their devices, and says so in
/// `vendors`. EGL of this process then has the others alone. Returns what to do.
std::string leaveOutBrokenVendors(std::vector<EglVendor>& vendors) {
  constexpr const char* kVendorFiles = "__EGL_VENDOR_LIBRARY_FILENAMES";  // libglvnd's
  std::string usable, broken;
  for (EglVendor& vendor : vendors) {
    if (!vendor.failure.empty()) continue;
    setenv(kVendorFiles, vendor.file.c_str(), 1);
    vendor.failure = listDevicesInChild().crash;
    std::string& files = vendor.failure.empty() ? usable : broken;
    files += (files.empty() ? "" : ":") + vendor.file;
  }
  setenv(kVendorFiles, usable.c_str(), 1);
  return "no program can use EGL until this is removed or updated: " + broken;
}

/// Probes and tests a device in a child process. Writes the picture to `out` if it is right and
/// `out` is not empty. Throws std::runtime_error if it cannot be written.
Json testDeviceInChild(std::size_t index, const std::filesystem::path& out) {
  const ChildAnswer answer = callInChild([&](const Send& send) {
    const render::DeviceProbe probe = render::probeDevice(index);
    Json device = toJson(index, probe, {"was not tested", 0, {}});
    send(dump(device, -1) + "\n");
    if (!probe.failure.empty()) return;
    const SelfTest selfTest = runSelfTest(index);
    device = toJson(index, probe, selfTest);
    try {
      if (isRight(device) && !out.empty()) render::writePng(out, render::toImage(selfTest.frame));
    } catch (const std::exception& error) {
      device["error"] = error.what();
    }
    send(dump(device, -1) + "\n");
  });
  std::istringstream lines(answer.text);
  Json device = toJson(index, {}, {});
  bool isProbed = false;
  for (std::string line; std::getline(lines, line);)
    if (Json read = Json::parse(line, nullptr, false); !read.is_discarded()) {
      device = std::move(read);
      isProbed = true;
    }
  if (device.contains("error")) throw std::runtime_error(getString(device["error"]));
  const std::string failure = answer.failure.empty() && !isProbed ? "exited" : answer.failure;
  if (!failure.empty()) device[isProbed ? "proof" : "failure"] = "the driver " + failure;
  return device;
}

std::string formatTable(const Json& report) {
  std::string table;
  const auto line = [&]<typename... T>(fmt::format_string<T...> pattern, T&&... values) {
    table += fmt::format(pattern, std::forward<T>(values)...) + "\n";
  };
  for (const Json& vendor : report["vendors"]) {
    line("vendor library {} ({}): {}", getString(vendor["library"]), getString(vendor["file"]),
         getString(vendor["failure"]).empty() ? "loads" : getString(vendor["failure"]));
  }
  if (report["vendors"].empty())
    line("EGL has no vendor library: no file in /usr/share/glvnd/egl_vendor.d");
  for (const Json& device : report["devices"]) {
    line("{}: {}: {}{}", device["index"].get<int>(), getString(device["place"]),
         getString(device["name"]).empty() ? "no name" : getString(device["name"]),
         device["software"].get<bool>() ? " (CPU)" : "");
    if (!getString(device["failure"]).empty()) {
      line("   cannot draw: {}", getString(device["failure"]));
      continue;
    }
    line("   OpenGL {}; self-test picture: {}; {:.0f} frames/s at {}x{}", getString(device["gl"]),
         getString(device["proof"]), device["frames_per_second"].get<double>(), kWidth, kHeight);
    if (!getString(device["uuid"]).empty()) line("   UUID {}", getString(device["uuid"]));
  }
  if (!getString(report["remedy"]).empty()) line("{}", getString(report["remedy"]));
  return table;
}

}  // namespace

ExitCode doctor(const DoctorCommand& command) {
  std::vector<EglVendor> vendors = listEglVendors();
  ListedDevices listed = listDevicesInChild();
  std::string remedy;
  if (!listed.crash.empty()) {
    remedy = leaveOutBrokenVendors(vendors);
    listed = listDevicesInChild();
  }
  Json report{{"vendors", toJson(vendors)}, {"devices", Json::array()}};
  bool gpuWorks = false, anyWorks = false;
  for (std::size_t i = 0; i < listed.list.count; ++i) {
    const Json device = testDeviceInChild(i, anyWorks ? "" : command.out);
    report["devices"].push_back(device);
    if (!isRight(device)) continue;
    anyWorks = true;
    gpuWorks = gpuWorks || !device["software"].get<bool>();
  }
  report["remedy"] = remedy.empty()
                         ? suggestRemedy(report["devices"], listed.list.failure, gpuWorks, anyWorks)
                         : remedy;
  const bool canDraw = command.requireGpu ? gpuWorks : anyWorks;
  report["can_draw"] = canDraw;
  writeToStdout(command.json ? dump(report, 2) + "\n" : formatTable(report));
  return canDraw ? ExitCode::success : ExitCode::runtimeError;
}

}  // namespace enfilade::server
