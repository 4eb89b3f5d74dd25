#include "server/app/command_arguments.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>

#include "protocol/nearest_word.hpp"
#include "scene/model/diagnostic_catalog.hpp"
#include "scene/model/rotation.hpp"
#include "scene/world/audit.hpp"
#include "scene/world/data/validation.hpp"
#include "server/app/validators.hpp"
#include "server/base/host_port.hpp"
#include "server/base/parse_number.hpp"
#include "server/inspection/inspection.hpp"
#include "server/runs/reported_run.hpp"

namespace enfilade::server {
namespace {

std::string validateFile(const std::string& text) {
  return text.empty() ? "the file name is empty: give one, for example walk.mcap" : "";
}

/// A picture's name in a folder that exists.
std::string validatePng(const std::string& text) {
  const std::filesystem::path file(text);
  if (file.extension() != ".png") return "'" + text + "' must end in .png";
  const std::filesystem::path folder = file.parent_path();
  if (!folder.empty() && !std::filesystem::is_directory(folder))
    return "the folder '" + folder.string() + "' does not exist";
  return {};
}

std::string validateEndpoint(const std::string& text) {
  if (parseHostPort(text)) return {};
  return text + ": give HOST:PORT with a port from 0 to 65535, for example 127.0.0.1:7878";
}

std::string validateAudit(const std::string& text) {
  const auto ticks = parseNumber<std::uint32_t>(text);
  if (ticks && *ticks <= scene::kMaxAuditInterval) return {};
  return text + ": give a whole number of ticks from 1 to " +
         std::to_string(scene::kMaxAuditInterval) + ", or 0 for no audit";
}

void addAudit(CLI::App& verb, CommandArguments& into) {
  setGroup(verb, "Checks");
  verb.add_option("--audit", into.auditEvery,
                  "Compare the broad phase with brute force every N ticks (0: never). Exits with 3 "
                  "if pairs differ. Cost: avatars x objects x 5 ns, spread over ticks of about 2 "
                  "ms")
      ->capture_default_str()
      ->check(CLI::Validator(validateAudit, "N"));
}

/// Sets one setting from the text of its option. Returns the error, or an empty text.
std::string setSetting(scene::WorldSettings& settings, double scene::WorldSettings::*field,
                       const std::string& text) {
  const auto number = parseNumber<double>(text);
  if (!number) return text + ": give a number";
  settings.*field = *number;
  return scene::validateWorldSettings(settings).value_or("");
}

CLI::Validator makeSettingValidator(double scene::WorldSettings::*field,
                                    const std::string& unit = "METRES") {
  return CLI::Validator(
      [field](const std::string& text) {
        scene::WorldSettings settings;
        return setSetting(settings, field, text);
      },
      unit);
}

/// Adds the options of motion. Defaults are in scene/world/data/world_settings.hpp.
void addMotion(CLI::App& verb, CommandArguments& into) {
  setGroup(verb, "Motion");
  verb.add_option("--step-height", into.stepHeight, "Highest step that avatars climb (0.3)")
      ->check(makeSettingValidator(&scene::WorldSettings::stepHeight));
  verb.add_option("--epsilon", into.epsilon,
                  "Gap that avatars and bodies keep from obstacles "
                  "(0.0005)")
      ->check(makeSettingValidator(&scene::WorldSettings::contactOffset));
  verb.add_option("--near-miss", into.nearMiss,
                  "Report pairs that come closer than this without contact; 0: none (0)")
      ->check(makeSettingValidator(&scene::WorldSettings::nearMissDistance));
  verb.add_option("--slope", into.slope, "Steepest slope that avatars stand on, in degrees (50)")
      ->check(makeRangeValidator(0, 89, "DEGREES"));
  verb.add_option("--speed-limit", into.speedLimit,
                  "Highest speed of commands and falls, in m/s (1000). Walks without a speed need "
                  "1.4; for contact horizons give about 4")
      ->check(makeSettingValidator(&scene::WorldSettings::maxSpeed, "SPEED"));
  verb.add_option("--sliding", into.sliding,
                  "Reaction to obstacles: avatars slide along them, "
                  "or stop")
      ->capture_default_str()
      ->check(makeChoiceValidator({"slide", "stop"}));
}

void addAccess(CLI::App& verb, CommandArguments& into) {
  setGroup(verb, "Access");
  verb.add_option("--token-file", into.tokenFile,
                  "File with a role (observe, drive, admin) and a token per line; clients need a "
                  "token")
      ->check(CLI::Validator(validateExistingFile, "FILE"));
  verb.add_flag("--insecure", into.access.insecure,
                "Allow a token file on a public address, although the connection is not encrypted");
  verb.add_option("--allow-host", into.access.hosts,
                  "Host names that browsers may use for the server, next to localhost and "
                  "addresses")
      ->type_name("HOST");
  verb.add_option("--allow-origin", into.access.origins,
                  "Origins whose pages may connect, for example https://example.org")
      ->type_name("URL");
}

void addDevice(CLI::App& verb, CommandArguments& into) {
  setGroup(verb, "Drawing");
  verb.add_option("--device", into.device.device,
                  "Graphics device: index, part of the name or UUID from `enfilade doctor`. "
                  "Default: "
                  "the best device")
      ->type_name("DEVICE");
  verb.add_flag("--require-gpu", into.device.requireGpu, "Exit with 1 if only a CPU can draw");
}

void addRenderer(CLI::App& verb, CommandArguments& into) {
  setGroup(verb, "Drawing");
  verb.add_option("--renderer", into.renderer,
                  "gl: OpenGL; rays: Embree ray tracing; auto: the faster one for device, size and "
                  "channels")
      ->capture_default_str()
      ->check(makeChoiceValidator({"auto", "gl", "rays"}));
}

void addWalk(CLI::App& verb, CommandArguments& into) {
  setGroup(verb, "Options");
  verb.add_option("SCRIPT", into.script, "Walk script: JSON lines (protocol/SCRIPT.md)")
      ->required();
  verb.add_option("--out", into.out, "Output folder for pictures, contacts and summary")
      ->required()
      ->check(CLI::Validator(validateFolder, "DIR"));
  verb.add_flag("--strict", into.strict,
                "Exit with 3 if an order was refused or a walk was "
                "blocked");
  into.samples = std::to_string(kCaptureSamples);
  verb.add_option("--samples", into.samples,
                  "Samples of the colour in each pixel of captures, which smooth its edges")
      ->capture_default_str()
      ->check(makeChoiceValidator({"1", "4", "16"}));
}

std::string validateTick(const std::string& text) {
  return parseNumber<std::uint64_t>(text) ? ""
                                          : text +
                                                ": give the number of a tick, for example "
                                                "600";
}

std::string validateRun(const std::string& text) {
  const auto run = parseNumber<std::uint32_t>(text);
  return run && *run > 0 ? "" : text + ": give the number of a run, starting at 1";
}

void addRun(CLI::App& verb, CommandArguments& into, const std::string& defaultRun) {
  verb.add_option("--run", into.run,
                  "Run of the RECORDING to use, numbered as in `enfilade inspect` (default: " +
                      defaultRun + ")")
      ->check(CLI::Validator(validateRun, "N"));
}

void addBranch(CLI::App& verb, CommandArguments& into) {
  setGroup(verb, "Recordings");
  verb.add_option("--from", into.from,
                  "[SCENE] RECORDING: start after this tick, from the nearest checkpoint")
      ->check(CLI::Validator(validateTick, "TICK"));
  verb.add_option("--then", into.then,
                  "Script that runs from there instead of the rest of the recording")
      ->check(CLI::Validator(validateFile, "SCRIPT"));
  addRun(verb, into, "the first; all for --verify without --from");
}

void addPlaybackOptions(CLI::App& serve, CommandArguments& into) {
  setGroup(serve, "Recordings");
  serve.add_option("--from", into.from, "RECORDING instead of SCENE: start after this tick")
      ->check(CLI::Validator(validateTick, "TICK"));
  addRun(serve, into, "the first");
  serve.footer(
      "Uses:\n"
      "  enfilade serve SCENE [FURTHER..]       a world per scene; clients enter by name\n"
      "  enfilade serve [SCENE] RECORDING       clients play, seek and take avatars over\n"
      "Each branch of a played recording has its own file: FILE, FILE-2, ... Exits with 4 if the\n"
      "replay diverges before the first served tick.\n"
      "Example: enfilade serve house.ifc --listen 127.0.0.1:0 --record walk.mcap");
}

void addRecording(CLI::App& verb, CommandArguments& into, const char* description) {
  setGroup(verb, "Recordings");
  CLI::Option* file = verb.add_option("--record", into.record.file, description)
                          ->check(CLI::Validator(validateFile, "FILE"));
  verb.add_option("--record-channels", into.recordChannels,
                  "walk: the data that a replay needs; foxglove: also channels for Foxglove and "
                  "Lichtblick, ten times a second")
      ->capture_default_str()
      ->check(makeChoiceValidator({"walk", "foxglove"}))
      ->needs(file);
  verb.add_option("--record-frames", into.recordFrames,
                  "Record JPEG views of each avatar, one per SECONDS of simulated time, and all "
                  "other "
                  "frames from its eyes; 0: only the other frames")
      ->check(makeRangeValidator(0, 1e6, "SECONDS"))
      ->needs(file);
}

void addTolerance(CLI::App& verb, CommandArguments& into) {
  setGroup(verb, "Comparison");
  verb.add_option("--tolerance", into.tolerance,
                  "Position and clearance differences up to this are ignored")
      ->capture_default_str()
      ->check(makeRangeValidator(0, 1000, "METRES"));
}

/// Empty if the word is a kind of problem; otherwise the error, with the nearest kind.
std::string validateProblemKind(const std::string& word) {
  std::vector<std::string> kinds{std::string(kAllWarnings)};
  for (const std::string_view kind : scene::listDiagnosticKinds()) kinds.emplace_back(kind);
  if (std::find(kinds.begin(), kinds.end(), word) != kinds.end()) return "";
  const std::string nearest = protocol::findNearestWord(word, kinds);
  return "'" + word + "' is not a kind of problem" +
         (nearest.empty() ? "; `enfilade inspect SCENE` lists them"
                          : "; did you mean '" + nearest + "'?");
}

}  // namespace

void addServeOptions(CLI::App& serve, CommandArguments& into) {
  addModel(serve, into.model);
  addPlaybackOptions(serve, into);
  setGroup(serve, "Options");
  serve.add_option("FURTHER", into.furtherScenes,
                   "Further models, each with its own world on this server");
  serve.add_option("--listen", into.listen, "Address and port; port 0: the system chooses a port")
      ->capture_default_str()
      ->check(CLI::Validator(validateEndpoint, "HOST:PORT"));
  addAccess(serve, into);
  setGroup(serve, "Options");
  serve.add_flag(
      "--stop-at-end-of-input", into.stopAtEndOfInput,
      "Stop when standard input is closed, so that the server ends with its parent process");
  addDevice(serve, into);
  addRenderer(serve, into);
  addAudit(serve, into);
  addMotion(serve, into);
  addRecording(
      serve, into,
      "Record the world `main`, or the branches of a played recording, to a new file (MCAP)");
}

void addReplayOptions(CLI::App& replay, CommandArguments& into) {
  addModel(replay, into.model);
  addWalk(replay, into);
  addDevice(replay, into);
  addRenderer(replay, into);
  addAudit(replay, into);
  addMotion(replay, into);
  addRecording(replay, into, "Record the walk to this file (MCAP)");
  for (const char* optional : {"SCRIPT", "--out"}) replay.get_option(optional)->required(false);
  setGroup(replay, "Recordings");
  replay.add_flag("--verify", into.verify,
                  "[SCENE] RECORDING: re-run it and compare the state after every tick; 4: "
                  "diverged");
  addBranch(replay, into);
  setGroup(replay, "Comparison");
  replay.add_flag("--json", into.json, "SCENE RECORDING: print the changes as one JSON object");
  replay
      .add_option("--pictures", into.pictures,
                  "SCENE RECORDING: maximum number of change pictures, worst first")
      ->capture_default_str()
      ->check(makeWholeRangeValidator(0, 1000, "N"));
  addTolerance(replay, into);
  replay.footer(
      "Uses:\n"
      "  enfilade replay SCENE SCRIPT --out DIR                run a walk script\n"
      "  enfilade replay [SCENE] RECORDING --verify            re-run and compare every tick\n"
      "  enfilade replay [SCENE] RECORDING --from TICK --then SCRIPT --out DIR\n"
      "                                                        continue a recording differently\n"
      "  enfilade replay SCENE RECORDING --out DIR             the same walk in another model\n"
      "The last use writes diff.txt, diff.json and changes/, and exits with 3 if something got\n"
      "worse (see enfilade diff --help).\n"
      "Example: enfilade replay house.glb walk.jsonl --out out --record walk.mcap --strict");
}

void addDiffOptions(CLI::App& verb, CommandArguments& into) {
  verb.add_option("BEFORE", into.before, "Recording (MCAP) of the earlier walk")->required();
  verb.add_option("AFTER", into.after, "Recording (MCAP) of the later walk")->required();
  verb.add_flag("--json", into.json, "Print one JSON object");
  addTolerance(verb, into);
  verb.footer(
      "Exits with 3 if something got worse: a new contact (except ground), a new blocked move, a\n"
      "new fall out of the scene, an order that no longer succeeds, or a clearance that shrank by\n"
      "more than the tolerance.\n"
      "Example: enfilade diff before.mcap after.mcap --json");
}

void addExportOptions(CLI::App& verb, CommandArguments& into) {
  addModel(verb, into.model);
  setGroup(verb, "Options");
  verb.add_option("--glb", into.glb,
                  "SCENE: file for the scene as binary glTF, with entity ids, instances and bodies")
      ->check(CLI::Validator(validateFile, "FILE"));
  verb.add_option(
          "--out", into.out,
          "RECORDING: folder for contacts.jsonl, trajectories in TUM format, and cameras.glb")
      ->check(CLI::Validator(validateFolder, "DIR"));
  verb.add_option("RECORDING", into.script, "A recording, if SCENE is the model to show it in");
  verb.add_option("--html", into.html,
                  "RECORDING: file that replays the walk in a browser, without a server")
      ->check(CLI::Validator(validateFile, "FILE"));
  addRun(verb, into, "1");
  verb.add_option("--max-size", into.maxMegabytes,
                  "Size of the --html file; above it, textures are left out first, then pictures")
      ->check(makeRangeValidator(1.0, 2000.0, "MB"))
      ->capture_default_str();
  verb.footer(
      "Uses:\n"
      "  enfilade export SCENE --glb FILE                the scene for viewers, as at /scene.glb\n"
      "  enfilade export RECORDING --out DIR             contacts, trajectories and cameras\n"
      "  enfilade export [SCENE] RECORDING --html FILE   the walk as one page, to be mailed\n"
      "Example: enfilade export walk.mcap --html walk.html");
}

void addCaptureCommandOptions(CLI::App& capture, CommandArguments& into) {
  addModel(capture, into.model);
  addCaptureOptions(capture, into.capture);
  addDevice(capture, into);
  capture.footer(
      "Formats, axes and shards: server/capture/CAPTURE.md.\n"
      "Example: enfilade capture house.glb path.txt --out frames --size 640x480 --channels "
      "rgb,depth");
}

void addWalkOptions(CLI::App& walk, CommandArguments& into) {
  addWalk(walk, into);
  walk.add_option("--connect", into.connect, "Address and port of the server")
      ->required()
      ->check(CLI::Validator(validateEndpoint, "HOST:PORT"));
  walk.add_option("--world", into.world, "World of the server; default: the main world")
      ->type_name("NAME");
  walk.add_option("--token", into.token, "Token, if the server requires one; or ENFILADE_TOKEN")
      ->envname("ENFILADE_TOKEN")
      ->type_name("TOKEN");
  walk.footer("Example: enfilade walk walk.jsonl --connect 127.0.0.1:7878 --out out");
}

void addDoctorOptions(CLI::App& verb, CommandArguments& into) {
  verb.add_flag("--json", into.doctor.json, "Print one JSON object");
  verb.add_flag("--require-gpu", into.doctor.requireGpu, "Exit with 1 if only a CPU can draw");
  verb.add_option("--out", into.doctor.out, "PNG file for the self-test picture")
      ->type_name("FILE");
  verb.footer("Example: enfilade doctor --require-gpu --json");
}

void addInspectOptions(CLI::App& inspect, CommandArguments& into) {
  addModel(inspect, into.model);
  inspect.get_option("SCENE")->description(
      "Model file (glTF, GLB, OBJ, COLLADA, FBX, IFC, PLY or STL) or recording (MCAP)");
  setGroup(inspect, "Options");
  inspect.add_flag("--json", into.json, "Print one JSON object");
  inspect.add_flag("--objects", into.objects,
                   "Also list all objects: id, path, box, class, operation");
  CLI::Option* strict =
      inspect.add_flag("--strict", into.strict, "Exit with 3 if there are warnings or errors");
  inspect
      .add_option("--accept", into.accepted,
                  "Kinds of problems with which --strict does not fail, or `warnings` for all "
                  "warnings; separated by commas")
      ->type_name("KIND,..")
      ->delimiter(',')
      ->check(CLI::Validator(validateProblemKind, ""))
      ->needs(strict);
  inspect.add_option("--html", into.html, "Also write the report with floor plans as an HTML page")
      ->check(CLI::Validator(validateFile, "FILE"));
  CLI::Option* plan =
      inspect.add_option("--plan", into.plan, "Folder for one floor plan per storey")
          ->check(CLI::Validator(validateFolder, "DIR"));
  inspect.add_option("--plan-format", into.planFormat, "Format of the plans")
      ->check(makeChoiceValidator({"png", "svg", "pdf"}))
      ->capture_default_str()
      ->needs(plan);
  inspect.add_option("--plan-scale", into.planScale, "Scale of svg and pdf plans: 1:N")
      ->check(makeRangeValidator(1.0, 100000.0, "N"))
      ->capture_default_str()
      ->needs(plan);
  inspect.footer(
      "Uses:\n"
      "  enfilade inspect SCENE      contents, problems, plans\n"
      "  enfilade inspect RECORDING  contents, damage (--json, --strict)\n"
      "Notes never fail --strict; the kinds of problems are listed by every report.\n"
      "Example: enfilade inspect house.ifc --plan out/plans --strict");
}

void addRouteOptions(CLI::App& verb, CommandArguments& into) {
  addModel(verb, into.model);
  setGroup(verb, "Options");
  constexpr const char* kPlaces =
      ": X,Y,Z in metres, or the name of a room, a storey, an object or a body (room:NAME, "
      "storey:NAME, "
      "object:PATH, body:NAME)";
  verb.add_option("FROM", into.route.from, std::string("Start") + kPlaces)->required();
  verb.add_option("TO", into.route.to, std::string("Goal") + kPlaces)->required();
  verb.add_option("--radius", into.route.agent.radius, "Radius of the walker")
      ->check(makeRangeValidator(0.05, 5.0, "METRES"))
      ->capture_default_str();
  verb.add_option("--height", into.route.agent.height, "Height of the walker")
      ->check(makeRangeValidator(0.2, 10.0, "METRES"))
      ->capture_default_str();
  verb.add_option("--speed", into.route.agent.speed, "Speed of the walk")
      ->check(makeRangeValidator(0.1, 20.0, "M/S"))
      ->capture_default_str();
  verb.add_flag("--doors-as-they-are", into.route.doorsAsTheyAre,
                "Doors that move stay as in the file. Default: they are open");
  verb.add_option("--drop", into.route.links.maxDrop,
                  "Maximum height of jumps down from edges. 0: none")
      ->check(makeRangeValidator(0, 10, "METRES"))
      ->capture_default_str();
  verb.add_flag("--lifts", into.route.links.lifts, "Allow paths that ride lifts");
  verb.add_flag("--json", into.json, "Print one JSON object");
  verb.add_option("--plan", into.plan, "Picture of the path on the plan, or of what is in the way")
      ->check(CLI::Validator(validatePng, "FILE.png"));
  addMotion(verb, into);
  verb.footer(
      "Every leg of the path was walked by the motion of avatars. Exits with 3 if there is no\n"
      "path; the reason names the object in the way and the clear width.\n"
      "Example: enfilade route house.ifc room:A101 room:A203 --plan route.png");
}

DrawingOptions makeDrawingOptions(const CommandArguments& read) {
  return {render::parseRendererKind(read.renderer).value_or(render::RendererKind::automatic),
          read.device};
}

RecordingChoice makeRecordingChoice(const CommandArguments& read) {
  RecordingChoice choice = read.record;
  if (!read.recordFrames.empty()) choice.pictureInterval = parseNumber<double>(read.recordFrames);
  choice.forViewers = choice.pictureInterval || read.recordChannels == "foxglove";
  return choice;
}

scene::WorldSettings makeWorldSettings(const CommandArguments& read) {
  scene::WorldSettings settings;
  if (!read.stepHeight.empty())
    setSetting(settings, &scene::WorldSettings::stepHeight, read.stepHeight);
  if (!read.epsilon.empty())
    setSetting(settings, &scene::WorldSettings::contactOffset, read.epsilon);
  if (!read.nearMiss.empty())
    setSetting(settings, &scene::WorldSettings::nearMissDistance, read.nearMiss);
  if (!read.speedLimit.empty())
    setSetting(settings, &scene::WorldSettings::maxSpeed, read.speedLimit);
  // makeHeadingFromDegrees() gives the same cosine on every processor, which determinism needs.
  if (!read.slope.empty())
    settings.walkableNormalY = scene::makeHeadingFromDegrees(*parseNumber<double>(read.slope)).x();
  settings.sliding = read.sliding == "stop" ? scene::Sliding::stop : scene::Sliding::slide;
  return settings;
}

}  // namespace enfilade::server
