#include "server/commands/doctor.hpp"

#include <spdlog/fmt/fmt.h>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
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
constexpr double kSeconds = 0.5;  // for which pictures are counted

struct Proof {
  std::string failure;  ///< why there is no picture that is right; empty: there is
  double framesPerSecond = 0;
  render::Frame frame;
};

double framesPerSecond(render::GlRenderer& renderer) {
  const auto begin = Clock::now();
  int frames = 0;
  double seconds = 0;
  for (; seconds < kSeconds; ++frames) {
    renderer.render({}, proofCamera(kWidth, kHeight));
    seconds = std::chrono::duration<double>(Clock::now() - begin).count();
  }
  return frames / seconds;
}

Proof prove(std::size_t device) {
  Proof proof;
  try {
    render::GlRenderer renderer(proofScene(), {.device = std::to_string(device)});
    proof.frame = renderer.render({}, proofCamera(kWidth, kHeight));
    proof.failure = proofProblem(proof.frame);
    proof.framesPerSecond = framesPerSecond(renderer);
  } catch (const render::RenderError& error) {
    proof.failure = error.what();
  }
  return proof;
}

/// What to install, when something is missing.
std::string remedy(const render::DeviceReport& report, bool gpuWorks, bool anyWorks) {
  if (!report.failure.empty() && report.devices.empty()) return report.failure;
  if (!anyWorks)
    return "for drawing on the CPU install libegl-mesa0, libgl1-mesa-dri and libopengl0; for an "
           "NVIDIA GPU its driver with libEGL_nvidia (in a container: "
           "NVIDIA_DRIVER_CAPABILITIES=graphics)";
  if (!gpuWorks)
    return "no GPU draws: install its vendor's EGL driver (NVIDIA: libnvidia-gl, in a container "
           "NVIDIA_DRIVER_CAPABILITIES=graphics; others: libgl1-mesa-dri and access to "
           "/dev/dri/renderD*)";
  return "";
}

Json vendorsAsJson() {
  Json vendors = Json::array();
  for (const EglVendor& vendor : eglVendors())
    vendors.push_back(
        {{"file", vendor.file}, {"library", vendor.library}, {"failure", vendor.failure}});
  return vendors;
}

Json asJson(std::size_t index, const render::DeviceTrial& trial, const Proof& proof) {
  return {{"index", index},
          {"place", trial.place},
          {"name", trial.name},
          {"vendor", trial.vendor},
          {"gl", trial.glVersion},
          {"uuid", trial.uuid},
          {"software", trial.software},
          {"failure", trial.failure},
          {"proof", trial.failure.empty() ? (proof.failure.empty() ? "right" : proof.failure) : ""},
          {"frames_per_second", std::round(10 * proof.framesPerSecond) / 10}};
}

std::string text(const Json& value) {
  return value.get<std::string>();
}

std::string tableOf(const Json& report) {
  std::string table;
  const auto line = [&]<typename... T>(fmt::format_string<T...> pattern, T&&... values) {
    table += fmt::format(pattern, std::forward<T>(values)...) + "\n";
  };
  for (const Json& vendor : report["vendors"]) {
    line("vendor library {} ({}): {}", text(vendor["library"]), text(vendor["file"]),
         text(vendor["failure"]).empty() ? "loads" : text(vendor["failure"]));
  }
  if (report["vendors"].empty())
    line("no vendor library is known to EGL: no file in /usr/share/glvnd/egl_vendor.d");
  for (const Json& device : report["devices"]) {
    line("{}: {}: {}{}", device["index"].get<int>(), text(device["place"]),
         text(device["name"]).empty() ? "no name" : text(device["name"]),
         device["software"].get<bool>() ? " (CPU)" : "");
    if (!text(device["failure"]).empty()) {
      line("   cannot draw: {}", text(device["failure"]));
      continue;
    }
    line("   OpenGL {}; proof picture: {}; {:.0f} frames/s at {}x{}", text(device["gl"]),
         text(device["proof"]), device["frames_per_second"].get<double>(), kWidth, kHeight);
    if (!text(device["uuid"]).empty()) line("   UUID {}", text(device["uuid"]));
  }
  if (!text(report["remedy"]).empty()) line("{}", text(report["remedy"]));
  return table;
}

}  // namespace

ExitCode doctor(const DoctorCommand& command) {
  const render::DeviceReport devices = render::tryDevices();
  Json report{{"vendors", vendorsAsJson()}, {"devices", Json::array()}};
  bool gpuWorks = false, anyWorks = false;
  for (std::size_t i = 0; i < devices.devices.size(); ++i) {
    const render::DeviceTrial& trial = devices.devices[i];
    const Proof proof = trial.failure.empty() ? prove(i) : Proof{};
    report["devices"].push_back(asJson(i, trial, proof));
    if (!trial.failure.empty() || !proof.failure.empty()) continue;
    if (!anyWorks && !command.out.empty())
      render::writePng(command.out, render::colourOf(proof.frame));
    anyWorks = true;
    gpuWorks = gpuWorks || !trial.software;
  }
  report["remedy"] = remedy(devices, gpuWorks, anyWorks);
  const bool enough = command.requireGpu ? gpuWorks : anyWorks;
  report["can_draw"] = enough;
  const auto replace = Json::error_handler_t::replace;
  writeToStdout(command.json ? report.dump(2, ' ', false, replace) + "\n" : tableOf(report));
  return enough ? ExitCode::done : ExitCode::runtimeError;
}

}  // namespace enfilade::server
