// The options of all commands: as texts from CLI11, and converted.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "server/app/capture_arguments.hpp"
#include "server/app/model_arguments.hpp"
#include "server/base/access.hpp"
#include "server/base/drawing_options.hpp"
#include "server/base/load_scene.hpp"
#include "server/commands/doctor.hpp"
#include "server/commands/route.hpp"
#include "server/recording/recording_options.hpp"

namespace CLI {
class App;
}

namespace enfilade::server {

/// The option values as CLI11 reads them. Each command uses some of them.
struct CommandArguments {
  DoctorCommand doctor;
  ModelArguments model;
  std::string script, out, plan, planFormat = "png", listen = "127.0.0.1:7878", connect;
  double planScale = 100, maxMegabytes = 50;
  std::string from, then, run, world, token, samples;
  RecordingChoice record;
  std::string recordChannels = "walk", recordFrames;
  bool strict = false, verify = false, json = false, objects = false, stopAtEndOfInput = false;
  CaptureArguments capture;
  RouteCommand route;
  std::string renderer = "auto";
  render::DeviceChoice device;
  std::string tokenFile;
  Access access;
  std::vector<std::filesystem::path> furtherScenes;
  std::string before, after, glb, html;
  std::vector<std::string> accepted;
  double tolerance = 0.001;
  std::uint32_t pictures = 12;
  std::string auditEvery = "0", epsilon, stepHeight, nearMiss, slope, speedLimit, sliding = "slide";
};

// Each function adds the options of one command with their validators. `into` must outlive `verb`.
void addServeOptions(CLI::App& verb, CommandArguments& into);
void addReplayOptions(CLI::App& verb, CommandArguments& into);
void addDiffOptions(CLI::App& verb, CommandArguments& into);
void addExportOptions(CLI::App& verb, CommandArguments& into);
void addCaptureCommandOptions(CLI::App& verb, CommandArguments& into);
void addWalkOptions(CLI::App& verb, CommandArguments& into);
void addDoctorOptions(CLI::App& verb, CommandArguments& into);
void addInspectOptions(CLI::App& verb, CommandArguments& into);
void addRouteOptions(CLI::App& verb, CommandArguments& into);

DrawingOptions makeDrawingOptions(const CommandArguments& read);
RecordingChoice makeRecordingChoice(const CommandArguments& read);
scene::WorldSettings makeWorldSettings(const CommandArguments& read);

}  // namespace enfilade::server
