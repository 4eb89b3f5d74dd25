// `enfilade capture`: renders frames along a camera path, for data sets.
#pragma once

#include <filesystem>

#include "render/device.hpp"
#include "server/base/exit_code.hpp"
#include "server/base/load_scene.hpp"
#include "server/capture/capture_options.hpp"

namespace enfilade::server {

struct CaptureCommand {
  ModelOptions model;
  std::filesystem::path path, out;
  PictureOptions pictures;
  CaptureRunOptions run;
  render::DeviceChoice device;
};

/// Throws the exceptions of planCapture(), render::RenderError, and std::runtime_error for a folder
/// that contains another capture or is not writable. Files written before are complete, and the
/// same command continues from there.
ExitCode capture(const CaptureCommand& command);

}  // namespace enfilade::server
