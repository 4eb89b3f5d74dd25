// The program's command line, read into plain data.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <variant>

#include "render/service/renderer.hpp"
#include "scene/import/bodies/collect_bodies.hpp"
#include "scene/import/import_model.hpp"
#include "scene/world/data/world_settings.hpp"
#include "server/base/access.hpp"
#include "server/base/exit_code.hpp"
#include "server/capture/capture_options.hpp"

namespace enfilade::server {

/// Overrides what the model's file says; nullopt: as the file says.
struct ModelOptions {
  std::filesystem::path file;
  std::optional<double> metresPerUnit;
  std::optional<char> up;  ///< 'x', 'y' or 'z'
  /// Metres, Y up: taken off the file's coordinates; nullopt: what brings it near the origin.
  std::optional<scene::Vec3> offset;
  bool cache = true;  ///< whether what an earlier start kept of the file may serve
  scene::IfcReader ifcReader = scene::IfcReader::automatic;
  scene::IfcDoors doors = scene::IfcDoors::move;
};

struct Endpoint {
  std::string host;        ///< a name or an address, IPv6 without its brackets
  std::uint16_t port = 0;  ///< listening: 0 lets the system choose
};

/// Who draws the pictures.
struct DrawingOptions {
  render::RendererKind renderer = render::RendererKind::automatic;
  render::DeviceChoice device;

  /// Something was asked for: then there is no going on without pictures.
  bool asked() const {
    return renderer != render::RendererKind::automatic || device.requireGpu ||
           !device.device.empty();
  }
};

/// A recording that is to be written.
struct RecordingChoice {
  std::filesystem::path file;  ///< empty: none
  bool viewers = false;        ///< with the channels that viewers show as they are
  /// With pictures of what each avatar sees, so many simulated seconds apart; 0: only those that
  /// are taken anyway. Brings `viewers` along.
  std::optional<double> pictures;
};

struct ServeCommand {
  ModelOptions model;  ///< its file is empty where `recording` says which
  Endpoint listen{"127.0.0.1", 7878};
  std::uint32_t auditEvery = 0;  ///< ticks; 0: never
  scene::Lengths lengths;
  std::filesystem::path tokenFile;  ///< empty: no tokens, everyone may do everything
  Access access;                    ///< without the tokens
  bool stopAtEndOfInput = false;    ///< ends when whoever started it has closed its standard input
  DrawingOptions drawing;
  std::vector<std::filesystem::path> furtherScenes;  ///< read as `model` is
  RecordingChoice record;
  /// A recording that clients play, from after tick `from` (nullopt: its first) on; empty: a new
  /// world. The lengths are then the recording's.
  std::filesystem::path recording = {};
  std::optional<std::uint64_t> from = {};
  std::uint32_t run = 1;  ///< of those in the recording
};
struct ReplayCommand {
  ModelOptions model;
  std::filesystem::path script, out;
  bool strict = false;
  std::uint32_t auditEvery = 0;  ///< ticks; 0: never
  scene::Lengths lengths;
  RecordingChoice record;
  DrawingOptions drawing;
  /// A recording that the script takes over after tick `from`; empty: a new world. The model's file
  /// is then empty where the recording says which, and the lengths are the recording's.
  std::filesystem::path recording = {};
  std::uint64_t from = 0;
  std::uint32_t run = 1;  ///< of those in the recording
};
struct VerifyCommand {
  std::filesystem::path scene;  ///< empty: where the recording says
  std::filesystem::path recording;
  bool cache = true;
  std::optional<std::uint64_t> from = {};  ///< a tick to begin after; none: all of it
  std::optional<std::uint32_t> run = {};   ///< none: all of them, or the first with `from`
};
/// What changed between two recorded walks.
struct DiffCommand {
  std::filesystem::path before, after;
  double tolerance = 0.001;  ///< metres by which places and clearances may differ
  bool json = false;
};
/// A recorded walk, made again in another model and compared.
struct RewalkCommand {
  ModelOptions model;
  std::filesystem::path recording, out;
  std::filesystem::path record;  ///< the new walk's recording; empty: new.mcap in `out`
  double tolerance = 0.001;      ///< as DiffCommand's
  bool json = false;
  std::uint32_t pictures = 12;  ///< of changes, the most
  DrawingOptions drawing;
  std::uint32_t run = 1;  ///< of those in the recording
};
/// A recording's contacts and ways as files that other programs read.
struct ExportCommand {
  std::filesystem::path recording, out;
};
struct WalkCommand {
  std::filesystem::path script, out;
  Endpoint connect;
  bool strict = false;
};
struct InspectCommand {
  ModelOptions model;
  bool json = false;
  bool objects = false;        ///< list each object
  bool strict = false;         ///< problems end it with `violations`
  std::filesystem::path plan;  ///< folder for a picture a storey; empty: none
};
struct CaptureCommand {
  ModelOptions model;
  std::filesystem::path path, out;
  PictureOptions pictures;
  CaptureRunOptions run;
  render::DeviceChoice device;
};
struct DoctorCommand {
  bool json = false;
  bool requireGpu = false;    ///< a CPU that draws is not enough
  std::filesystem::path out;  ///< where the proof picture goes; empty: nowhere
};
using ProgramCommand =
    std::variant<DoctorCommand, ServeCommand, ReplayCommand, VerifyCommand, CaptureCommand,
                 WalkCommand, InspectCommand, DiffCommand, RewalkCommand, ExportCommand>;

/// What to do, or the code to end with at once (--help: done; a mistake: usage). Help goes to
/// stdout, mistakes and the usage to stderr.
std::variant<ProgramCommand, ExitCode> readCommandLine(int argc, const char* const* argv);

/// Parses `HOST:PORT` or `[IPV6]:PORT`; nullopt when it is neither.
std::optional<Endpoint> endpointFrom(const std::string& text);

}  // namespace enfilade::server
