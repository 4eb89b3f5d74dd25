#include "server/commands/doctor.hpp"

#include <fmt/core.h>

#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>

#include "render/gl/egl_context.hpp"
#include "render/gl/gl_renderer.hpp"
#include "render/image/image.hpp"
#include "server/base/standard_output.hpp"
#include "server/commands/egl_vendors.hpp"
#include "server/commands/self_test_scene.hpp"

namespace enfilade::server {
namespace {

using Json = nlohmann::ordered_json;
using Clock = std::chrono::steady_clock;

constexpr int kWidth = 640, kHeight = 480;
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
std::string suggestRemedy(const render::DeviceReport& report, bool gpuWorks, bool anyWorks) {
  if (!report.failure.empty() && report.devices.empty()) return report.failure;
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

Json vendorsToJson() {
  Json vendors = Json::array();
  for (const EglVendor& vendor : listEglVendors())
    vendors.push_back(
        {{"file", vendor.file}, {"library", vendor.library}, {"failure", vendor.failure}});
  return vendors;
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
           probe.failure.empty() ? (selfTest.failure.empty() ? "right" : selfTest.failure) : ""},
          {"frames_per_second", std::round(10 * selfTest.framesPerSecond) / 10}};
}

std::string getString(const Json& value) {
  return value.get<std::string>();
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
  const render::DeviceReport devices = render::probeDevices();
  Json report{{"vendors", vendorsToJson()}, {"devices", Json::array()}};
  bool gpuWorks = false, anyWorks = false;
  for (std::size_t i = 0; i < devices.devices.size(); ++i) {
    const render::DeviceProbe& probe = devices.devices[i];
    const SelfTest selfTest = probe.failure.empty() ? runSelfTest(i) : SelfTest{};
    report["devices"].push_back(toJson(i, probe, selfTest));
    if (!probe.failure.empty() || !selfTest.failure.empty()) continue;
    if (!anyWorks && !command.out.empty())
      render::writePng(command.out, render::toImage(selfTest.frame));
    anyWorks = true;
    gpuWorks = gpuWorks || !probe.software;
  }
  report["remedy"] = suggestRemedy(devices, gpuWorks, anyWorks);
  const bool canDraw = command.requireGpu ? gpuWorks : anyWorks;
  report["can_draw"] = canDraw;
  const auto replace = Json::error_handler_t::replace;
  writeToStdout(command.json ? report.dump(2, ' ', false, replace) + "\n" : formatTable(report));
  return canDraw ? ExitCode::success : ExitCode::runtimeError;
}

}  // namespace enfilade::server
