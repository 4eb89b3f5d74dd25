// Runs a walk script and writes its report. The world is in this process (replay) or behind a
// socket (walk).
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>

#include "protocol/script/script_run.hpp"
#include "render/service/renderer_selector.hpp"
#include "scene/world/data/world_settings.hpp"
#include "server/base/drawing_options.hpp"
#include "server/base/exit_code.hpp"
#include "server/base/host_port.hpp"
#include "server/base/load_scene.hpp"
#include "server/recording/recording_options.hpp"

namespace enfilade::server {

/// Of the colour in each pixel of a script's captures, which are few and for people.
constexpr std::uint32_t kCaptureSamples = 4;

struct ReplayCommand {
  ModelOptions model;
  std::filesystem::path script, out;
  bool strict = false;
  std::uint32_t auditEvery = 0;  ///< ticks; 0: never
  scene::WorldSettings settings;
  RecordingChoice record;
  DrawingOptions drawing;
  /// The recording that the script takes over after tick `from`; empty: a new world. The recording
  /// then provides the settings and, if the model's file is empty, the scene.
  std::filesystem::path recording = {};
  std::uint64_t from = 0;
  std::uint32_t run = 1;  ///< number of the run in the recording
  std::uint32_t samples = kCaptureSamples;
};

struct WalkCommand {
  std::filesystem::path script, out;
  HostPort connect;
  std::string world;  ///< empty: the main world
  std::string token;  ///< empty: none
  bool strict = false;
  std::uint32_t samples = kCaptureSamples;
};

ExitCode replay(const ReplayCommand& command);
ExitCode walk(const WalkCommand& command);

/// Computes the exit code of a completed run. Audit findings and, with `strict`, failed script
/// lines are violations.
ExitCode computeExitCode(const protocol::ScriptResult& result, const v1::Metrics& metrics,
                         bool strict);

/// Makes the renderer. If none is available and none was requested: logs it and returns null.
/// Throws render::RenderError.
std::unique_ptr<render::RendererSelector> tryMakeRenderer(
    const std::shared_ptr<const scene::Scene>& scene, const DrawingOptions& drawing);

}  // namespace enfilade::server
