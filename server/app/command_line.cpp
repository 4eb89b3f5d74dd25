#include "server/app/command_line.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>

#include "protocol/mcap/reader.hpp"
#include "scene/import/import_model.hpp"
#include "scene/model/rotation.hpp"
#include "scene/world/audit.hpp"
#include "server/base/server_limits.hpp"
#include "server/base/version.hpp"
#include "server/capture/capture_arguments.hpp"

namespace enfilade::server {
namespace {

/// Where CLI11 leaves what it read; every verb has its own.
struct ModelArguments {
  std::string file, unit, up, ifcReader = "auto", ifcDoors = "move";
  std::vector<double> offset;
  bool noCache = false;
};
struct Arguments {
  DoctorCommand doctor;
  ModelArguments model;
  std::string script, out, plan, listen = "127.0.0.1:7878", connect;
  std::string from, then, run;
  RecordingChoice record;
  std::string recordChannels = "walk", recordFrames;
  bool strict = false, verify = false, json = false, objects = false, stopAtEndOfInput = false;
  CaptureArguments capture;
  std::string renderer = "auto";
  render::DeviceChoice device;
  std::string tokenFile;
  Access access;
  std::vector<std::filesystem::path> furtherScenes;
  std::string before, after, recording;
  double tolerance = 0.001;
  std::uint32_t pictures = 12;
  std::string auditEvery = "0", epsilon, stepHeight, nearMiss, slope, sliding = "slide";
};

std::string unitProblem(const std::string& text) {
  if (scene::metresPerUnitFrom(text)) return {};
  return text + ": give m, mm, cm, ft, in or a positive number of metres";
}

std::string folderProblem(const std::string& text) {
  return text.empty() ? "the folder's name is empty: give one, as out" : "";
}

std::string fileProblem(const std::string& text) {
  return text.empty() ? "the file's name is empty: give one, as walk.mcap" : "";
}

std::string endpointProblem(const std::string& text) {
  if (endpointFrom(text)) return {};
  return text + ": give HOST:PORT, as 127.0.0.1:7878, with a port from 0 to 65535";
}

/// The number that the whole text is, in decimal; nullopt when it is none.
template <typename Number>
std::optional<Number> numberFrom(const std::string& text) {
  const char* end = text.data() + text.size();
  Number number{};
  const auto parsed = std::from_chars(text.data(), end, number);
  if (parsed.ec != std::errc() || parsed.ptr != end) return std::nullopt;
  return number;
}

std::string secondsProblem(const std::string& text) {
  const auto seconds = numberFrom<double>(text);
  if (seconds && *seconds >= 0 && *seconds <= 1e6) return {};
  return text + ": give seconds from 0 to 1000000";
}

std::string toleranceProblem(const std::string& text) {
  const auto metres = numberFrom<double>(text);
  if (metres && *metres >= 0 && *metres <= 1000) return {};
  return text + ": give metres from 0 to 1000";
}

std::string auditProblem(const std::string& text) {
  const auto ticks = numberFrom<std::uint32_t>(text);
  if (ticks && *ticks <= scene::kSparsestAudit) return {};
  return text + ": give a whole number of ticks from 1 to " +
         std::to_string(scene::kSparsestAudit) + ", or 0 for no audit";
}

void addAudit(CLI::App& verb, Arguments& into) {
  verb.add_option("--audit", into.auditEvery,
                  "Compare the pairs of every Nth tick with brute force; 0: never. An audited tick "
                  "takes longer by avatars x objects box tests of some 5 ns; what takes more than "
                  "2 ms the avatars share in turn, at least one a time (a million objects: 5 to "
                  "10 ms). Ends with 3 if something was found")
      ->capture_default_str()
      ->check(CLI::Validator(auditProblem, "N"));
}

/// Sets one length from its option's text; the text says why it cannot.
std::string setLength(scene::Lengths& lengths, double scene::Lengths::*length,
                      const std::string& text) {
  const auto number = numberFrom<double>(text);
  if (!number) return text + " is no number";
  lengths.*length = *number;
  return scene::lengthsProblem(lengths).value_or("");
}

std::string slopeProblem(const std::string& text) {
  const auto degrees = numberFrom<double>(text);
  return degrees && *degrees >= 0 && *degrees <= 89 ? "" : text + ": give 0 to 89 degrees";
}

CLI::Validator lengthCheck(double scene::Lengths::*length) {
  return CLI::Validator(
      [length](const std::string& text) {
        scene::Lengths lengths;
        return setLength(lengths, length, text);
      },
      "METRES");
}

/// What is left out stays as scene/world/data/world_settings.hpp has it.
void addMotion(CLI::App& verb, Arguments& into) {
  verb.add_option("--step-height", into.stepHeight, "Highest ledge that is walked up (0.3)")
      ->check(lengthCheck(&scene::Lengths::stepHeight));
  verb.add_option("--epsilon", into.epsilon, "Movers rest so far from what they lean on (0.0005)")
      ->check(lengthCheck(&scene::Lengths::epsilon));
  verb.add_option("--near-miss", into.nearMiss,
                  "Tell pairs that come nearer than this without contact; 0: none (0)")
      ->check(lengthCheck(&scene::Lengths::nearMiss));
  verb.add_option("--slope", into.slope, "Steepest ground that is stood on, in degrees (50)")
      ->check(CLI::Validator(slopeProblem, "DEGREES"));
  verb.add_option("--sliding", into.sliding, "What blocks an avatar turns or stops it")
      ->capture_default_str()
      ->check(CLI::IsMember({"slide", "stop"}));
}

scene::Lengths lengthsFrom(const Arguments& read) {
  scene::Lengths lengths;
  if (!read.stepHeight.empty()) setLength(lengths, &scene::Lengths::stepHeight, read.stepHeight);
  if (!read.epsilon.empty()) setLength(lengths, &scene::Lengths::epsilon, read.epsilon);
  if (!read.nearMiss.empty()) setLength(lengths, &scene::Lengths::nearMiss, read.nearMiss);
  // The heading's cosine is the same on every processor, as what decides motion must be.
  if (!read.slope.empty())
    lengths.walkableNormalY = scene::headingFromDegrees(*numberFrom<double>(read.slope)).x();
  lengths.sliding = read.sliding == "stop" ? scene::Sliding::stop : scene::Sliding::slide;
  return lengths;
}

void addAccess(CLI::App& verb, Arguments& into) {
  verb.add_option("--token-file", into.tokenFile,
                  "Lines of a role (observe, drive, admin) and a token; clients must have one")
      ->check(CLI::ExistingFile);
  verb.add_flag("--insecure", into.access.insecure,
                "Listen, with a token file, where others can reach it, without encryption");
  verb.add_option("--allow-host", into.access.hosts,
                  "Names that browsers may call the server by, beside localhost and addresses");
  verb.add_option("--allow-origin", into.access.origins,
                  "Origins whose pages may connect, as https://example.org");
}

void addModel(CLI::App& verb, ModelArguments& into) {
  verb.add_option("SCENE", into.file, "The model: glTF, GLB, OBJ, COLLADA, FBX, IFC, IFCZIP")
      ->required();
  verb.add_option("--unit", into.unit, "Length of the file's unit: m, mm, cm, ft, in or metres")
      ->check(CLI::Validator(unitProblem, "UNIT"));
  verb.add_option("--up", into.up, "The file's up axis")->check(CLI::IsMember({"x", "y", "z"}));
  verb.add_option("--offset", into.offset,
                  "Metres, Y up, that are taken off the file's coordinates, so that versions of a "
                  "model stand alike; left out: none near the origin, else what brings it there")
      ->delimiter(',')
      ->expected(3);
  verb.add_flag("--no-cache", into.noCache,
                "Import the model even if an earlier start kept what it made of it");
  verb.add_option(
          "--ifc-reader", into.ifcReader,
          "Who reads IFC. auto: web-ifc; ifcplusplus where that fails or Node.js is missing "
          "and for products that it leaves out; assimp last")
      ->capture_default_str()
      ->check(CLI::IsMember({"auto", "web-ifc", "ifcplusplus", "assimp"}));
  verb.add_option("--ifc-doors", into.ifcDoors,
                  "Doors and lifts of IFC. move: they are bodies where the file says enough; "
                  "still: only what a sidecar names moves")
      ->capture_default_str()
      ->check(CLI::IsMember({"move", "still"}));
}

void addDevice(CLI::App& verb, Arguments& into) {
  verb.add_option("--device", into.device.device,
                  "Who draws: an index, a part of the name or the UUID, as `enfilade doctor` lists "
                  "them; left out: the best");
  verb.add_flag("--require-gpu", into.device.requireGpu, "End with 1 when only a CPU draws");
}

void addRenderer(CLI::App& verb, Arguments& into) {
  verb.add_option(
          "--renderer", into.renderer,
          "gl: OpenGL; rays: cast with Embree; auto: the faster one, by device, size and channels")
      ->capture_default_str()
      ->check(CLI::IsMember({"auto", "gl", "rays"}));
}

void addWalk(CLI::App& verb, Arguments& into) {
  verb.add_option("SCRIPT", into.script, "The walk: JSON lines, see protocol/SCRIPT.md")
      ->required();
  verb.add_option("--out", into.out, "Folder for the pictures, contacts and summary")
      ->required()
      ->check(CLI::Validator(folderProblem, "DIR"));
  verb.add_flag("--strict", into.strict, "End with 3 when an order was refused or a walk blocked");
}

std::string tickProblem(const std::string& text) {
  return numberFrom<std::uint64_t>(text) ? "" : text + ": give the number of a tick, as 600";
}

std::string runProblem(const std::string& text) {
  const auto run = numberFrom<std::uint32_t>(text);
  return run && *run > 0 ? "" : text + ": give the number of a run, from 1";
}

void addRun(CLI::App& verb, Arguments& into, const std::string& leftOut) {
  verb.add_option("--run", into.run,
                  "Of a RECORDING in which the world begins anew that run, as `enfilade inspect` "
                  "counts them (" +
                      leftOut + ")")
      ->check(CLI::Validator(runProblem, "N"));
}

void addBranch(CLI::App& verb, Arguments& into) {
  verb.add_option("--from", into.from,
                  "[SCENE] RECORDING: begin after this tick, at the nearest checkpoint")
      ->check(CLI::Validator(tickProblem, "TICK"));
  verb.add_option("--then", into.then,
                  "A script that takes over there: what was recorded after it is not done")
      ->check(CLI::Validator(fileProblem, "SCRIPT"));
  addRun(verb, into, "the first; --verify without --from: all");
}

void addPlayed(CLI::App& serve, Arguments& into) {
  serve.add_option("--from", into.from, "RECORDING in the place of SCENE: begin after this tick")
      ->check(CLI::Validator(tickProblem, "TICK"));
  addRun(serve, into, "the first");
  serve.footer(
      "RECORDING (MCAP) in the place of SCENE, or after the one scene that it is played in: "
      "clients "
      "play it, seek in it and take it over (protocol/PROTOCOL.md). --record then writes down what "
      "branches off it: FILE, FILE-2 and so on, each a recording of its own. Ends with 4 where the "
      "recording cannot be made again.");
}

void addRecording(CLI::App& verb, Arguments& into, const char* what) {
  CLI::Option* file = verb.add_option("--record", into.record.file, what)
                          ->check(CLI::Validator(fileProblem, "FILE"));
  verb.add_option(
          "--record-channels", into.recordChannels,
          "walk: what makes the walk again; foxglove: beside it what Foxglove and Lichtblick "
          "show as they are, ten times a second")
      ->capture_default_str()
      ->check(CLI::IsMember({"walk", "foxglove"}))
      ->needs(file);
  verb.add_option("--record-frames", into.recordFrames,
                  "Record what each avatar sees as JPEG, every so many simulated seconds, and what "
                  "else is drawn through its eyes; 0: only that")
      ->check(CLI::Validator(secondsProblem, "SECONDS"))
      ->needs(file);
}

void addInspect(CLI::App& verb, Arguments& into) {
  verb.add_flag("--json", into.json, "Tell it as one JSON object");
  verb.add_flag("--objects", into.objects,
                "List every object too: id, path, box, class, operation");
  verb.add_flag("--strict", into.strict, "End with 3 when there are problems");
  verb.add_option("--plan", into.plan, "Folder for a picture of the plan of each storey")
      ->check(CLI::Validator(folderProblem, "DIR"));
}

void addTolerance(CLI::App& verb, Arguments& into) {
  verb.add_option("--tolerance", into.tolerance,
                  "Metres by which places and clearances may differ untold")
      ->capture_default_str()
      ->check(CLI::Validator(toleranceProblem, "METRES"));
}

void addDiff(CLI::App& verb, Arguments& into) {
  verb.add_option("BEFORE", into.before, "The earlier walk's recording (MCAP)")->required();
  verb.add_option("AFTER", into.after, "The later walk's recording")->required();
  verb.add_flag("--json", into.json, "Tell it as one JSON object");
  addTolerance(verb, into);
  verb.footer(
      "Ends with 3 when something got worse: a contact (with anything but the ground), a blocked "
      "move or a fall out of the scene that is new, an order that went well and does not any more, "
      "a clearance that is smaller by more than the tolerance. Ends with 0 otherwise.");
}

void addExport(CLI::App& verb, Arguments& into) {
  verb.add_option("RECORDING", into.recording, "The recording (MCAP)")->required();
  verb.add_option("--out", into.out,
                  "Folder for contacts.jsonl, the ways as TUM text, and cameras.glb")
      ->required()
      ->check(CLI::Validator(folderProblem, "DIR"));
}

void addDoctor(CLI::App& verb, Arguments& into) {
  verb.add_flag("--json", into.doctor.json, "Tell it as one JSON object");
  verb.add_flag("--require-gpu", into.doctor.requireGpu, "End with 1 when only a CPU draws");
  verb.add_option("--out", into.doctor.out, "Write the proof picture to this PNG file");
}

RecordingChoice recordingFrom(const Arguments& read) {
  RecordingChoice choice = read.record;
  if (!read.recordFrames.empty()) choice.pictures = numberFrom<double>(read.recordFrames);
  choice.viewers = choice.pictures || read.recordChannels == "foxglove";
  return choice;
}

DrawingOptions drawingFrom(const Arguments& read) {
  return {render::rendererKindFrom(read.renderer).value_or(render::RendererKind::automatic),
          read.device};
}

ModelOptions modelFrom(const ModelArguments& read) {
  ModelOptions options;
  options.file = read.file;
  options.cache = !read.noCache;
  if (!read.unit.empty()) options.metresPerUnit = scene::metresPerUnitFrom(read.unit);
  if (!read.up.empty()) options.up = read.up.front();
  if (!read.offset.empty()) options.offset = {read.offset[0], read.offset[1], read.offset[2]};
  options.ifcReader = scene::ifcReaderFrom(read.ifcReader).value_or(scene::IfcReader::automatic);
  options.doors = read.ifcDoors == "still" ? scene::IfcDoors::still : scene::IfcDoors::move;
  return options;
}

/// A recording stands last; before it the scene, if it is named.
VerifyCommand verifyFrom(const Arguments& read) {
  const bool named = !read.script.empty();
  VerifyCommand command{
      named ? read.model.file : "", named ? read.script : read.model.file, !read.model.noCache, {}};
  if (!read.from.empty()) command.from = numberFrom<std::uint64_t>(read.from);
  if (!read.run.empty()) command.run = numberFrom<std::uint32_t>(read.run);
  return command;
}

/// The script of --then takes over a recording.
void branchFrom(const Arguments& read, ReplayCommand& command) {
  const VerifyCommand recorded = verifyFrom(read);
  command.model.file = recorded.scene;
  command.recording = recorded.recording;
  command.script = read.then;
  command.from = recorded.from.value_or(0);
  command.run = recorded.run.value_or(1);
}

/// What a recording says itself; empty: nothing of it was given.
std::string recordedProblem(const CLI::App& verb) {
  for (const char* option : {"--step-height", "--epsilon", "--slope", "--sliding", "--near-miss",
                             "--unit", "--up", "--ifc-reader", "--ifc-doors"})
    if (verb.count(option) > 0) return std::string(option) + " is the recording's to say";
  return "";
}

ExitCode misused(const char* verb, const std::string& problem) {
  std::cerr << "enfilade: " << problem << "\nenfilade " << verb << " --help tells what there is\n";
  return ExitCode::usage;
}

bool isRewalk(const Arguments& read) {
  return !read.verify && read.then.empty() && protocol::mcap::isMcap(read.script);
}

/// What of a replay of a recording does not go with what; empty: all does.
std::string branchProblem(const CLI::App& replay, const Arguments& read) {
  if (!read.run.empty() && !read.verify && read.then.empty() && !isRewalk(read))
    return "--run is of a recording: --verify, --then SCRIPT, or SCENE RECORDING";
  if (read.from.empty()) return read.then.empty() ? "" : "--then needs --from TICK";
  if (read.then.empty() && !read.verify)
    return "--from needs --verify, or --then SCRIPT that goes on from there";
  if (!read.then.empty() && read.verify) return "--then makes a new walk: it has nothing to verify";
  return recordedProblem(replay);
}

/// What `serve` does not take beside a recording that it plays, or without one; empty: all does.
std::string playedProblem(const CLI::App& serve, const ServeCommand& command) {
  if (command.recording.empty())
    return command.from || serve.count("--run") > 0
               ? "--from and --run need a recording in the place of SCENE"
               : "";
  for (const std::filesystem::path& further : command.furtherScenes)
    if (protocol::mcap::isMcap(further))
      return further.string() +
             ": one recording is played: `serve RECORDING [FURTHER..]`, or "
             "`serve SCENE RECORDING` in a scene that it does not name";
  return recordedProblem(serve);
}

/// A recording stands in the place of the scene, or alone after it.
void playedFrom(const Arguments& read, ServeCommand& command) {
  using protocol::mcap::isMcap;
  if (!read.from.empty()) command.from = numberFrom<std::uint64_t>(read.from);
  command.run = numberFrom<std::uint32_t>(read.run).value_or(1);
  if (isMcap(command.model.file)) {
    command.recording = std::exchange(command.model.file, {});
  } else if (!command.furtherScenes.empty() && isMcap(command.furtherScenes.front())) {
    command.recording = std::move(command.furtherScenes.front());
    command.furtherScenes.erase(command.furtherScenes.begin());
  }
}

std::uint32_t auditFrom(const Arguments& read) {
  return numberFrom<std::uint32_t>(read.auditEvery).value_or(0);
}

std::variant<ProgramCommand, ExitCode> serveFrom(const CLI::App& serve, const Arguments& read) {
  const std::size_t worlds = 1 + read.furtherScenes.size(), mostWorlds = ServerLimits{}.worlds;
  if (worlds > mostWorlds) {
    std::cerr << "enfilade: serve: " << worlds << " scenes are more than the " << mostWorlds
              << " worlds of a server: give fewer, or start another server\n";
    return ExitCode::usage;
  }
  ServeCommand command{modelFrom(read.model), *endpointFrom(read.listen),
                       auditFrom(read),       lengthsFrom(read),
                       read.tokenFile,        read.access,
                       read.stopAtEndOfInput, drawingFrom(read),
                       read.furtherScenes,    recordingFrom(read)};
  playedFrom(read, command);
  if (const std::string problem = playedProblem(serve, command); !problem.empty())
    return misused("serve", problem);
  return command;
}

/// What a walk that is made again in another model does not take; empty: nothing of it is there.
std::string rewalkProblem(const CLI::App& replay) {
  for (const char* option : {"--strict", "--audit", "--step-height", "--epsilon", "--slope",
                             "--sliding", "--near-miss", "--record-channels", "--record-frames"})
    if (replay.count(option) > 0)
      return std::string(option) + ": a recorded walk is made again as it was recorded";
  return "";
}

RewalkCommand rewalkFrom(const Arguments& read) {
  return {
      modelFrom(read.model), read.script,       read.out,
      read.record.file,      read.tolerance,    read.json,
      read.pictures,         drawingFrom(read), numberFrom<std::uint32_t>(read.run).value_or(1)};
}

/// What a replay that verifies nothing cannot do without.
std::optional<std::string> missingFrom(const Arguments& read) {
  if (read.script.empty() && read.then.empty() && protocol::mcap::isMcap(read.model.file))
    return "SCENE is required: the model to make the recorded walk again in; --verify and "
           "`enfilade export` take a recording alone";
  if (read.script.empty() && read.then.empty())
    return "SCRIPT is required: the walk, JSON lines (protocol/SCRIPT.md)";
  if (read.out.empty()) return "--out is required: a folder for the pictures, contacts and summary";
  return std::nullopt;
}

std::variant<ProgramCommand, ExitCode> replayFrom(const CLI::App& replay, const Arguments& read) {
  std::string problem = branchProblem(replay, read);
  if (problem.empty() && isRewalk(read)) problem = rewalkProblem(replay);
  if (problem.empty() && !read.verify) problem = missingFrom(read).value_or("");
  if (!problem.empty()) return misused("replay", problem);
  if (read.verify) return verifyFrom(read);
  if (isRewalk(read)) return rewalkFrom(read);
  ReplayCommand command{modelFrom(read.model), read.script,      read.out,
                        read.strict,           auditFrom(read),  lengthsFrom(read),
                        recordingFrom(read),   drawingFrom(read)};
  if (!read.then.empty()) branchFrom(read, command);
  return command;
}

void addServe(CLI::App& serve, Arguments& into) {
  addModel(serve, into.model);
  addPlayed(serve, into);
  serve.add_option("FURTHER", into.furtherScenes,
                   "Further models: scenes of the same server, each with a world of its own");
  serve.add_option("--listen", into.listen, "Address and port; port 0 lets the system choose")
      ->capture_default_str()
      ->check(CLI::Validator(endpointProblem, "HOST:PORT"));
  addAccess(serve, into);
  serve.add_flag(
      "--stop-at-end-of-input", into.stopAtEndOfInput,
      "End when standard input is closed: so the server does not outlive who started it");
  addDevice(serve, into);
  addRenderer(serve, into);
  addAudit(serve, into);
  addMotion(serve, into);
  addRecording(
      serve, into,
      "Write a recording (MCAP) of the world main, or of a replay's branches, to a new file");
}

void addReplay(CLI::App& replay, Arguments& into) {
  addModel(replay, into.model);
  addWalk(replay, into);
  addDevice(replay, into);
  addRenderer(replay, into);
  addAudit(replay, into);
  addMotion(replay, into);
  addRecording(replay, into, "Write a recording (MCAP) of the walk");
  for (const char* needless : {"SCRIPT", "--out"}) replay.get_option(needless)->required(false);
  replay.add_flag("--verify", into.verify,
                  "[SCENE] RECORDING: make a recorded walk again; ends with 4 where it differs");
  addBranch(replay, into);
  replay.add_flag("--json", into.json, "SCENE RECORDING: print what changed as one JSON object");
  replay
      .add_option("--pictures", into.pictures,
                  "SCENE RECORDING: of how many changes pictures are made, the worst first")
      ->capture_default_str()
      ->check(CLI::Range(0U, 1000U));
  addTolerance(replay, into);
  replay.footer(
      "SCENE RECORDING makes a recorded walk again in another model, writes what changed to "
      "diff.txt, diff.json and changes/, and ends with 3 when something got worse, as `enfilade "
      "diff` has it.");
}

void addCapturing(CLI::App& capture, Arguments& into) {
  addModel(capture, into.model);
  addCapture(capture, into.capture);
  addDevice(capture, into);
}

void addWalkOnServer(CLI::App& walk, Arguments& into) {
  addWalk(walk, into);
  walk.add_option("--connect", into.connect, "The server's address and port")
      ->required()
      ->check(CLI::Validator(endpointProblem, "HOST:PORT"));
}

void addInspection(CLI::App& inspect, Arguments& into) {
  addModel(inspect, into.model);
  addInspect(inspect, into);
}

using Asked = std::variant<ProgramCommand, ExitCode>;

struct Verb {
  const char* name;
  const char* does;
  void (*addOptions)(CLI::App& verb, Arguments& into);
  Asked (*commandFrom)(const CLI::App& verb, const Arguments& read);
};

const Verb kVerbs[] = {
    {"serve", "Serve a scene, or a recording, to clients over TCP", addServe, serveFrom},
    {"replay", "Run a walk script, or a recorded walk, in a scene", addReplay, replayFrom},
    {"diff", "Tell what changed between two recorded walks", addDiff,
     [](const CLI::App&, const Arguments& read) -> Asked {
       return DiffCommand{read.before, read.after, read.tolerance, read.json};
     }},
    {"export", "Write a recording's contacts and ways as text and glTF", addExport,
     [](const CLI::App&, const Arguments& read) -> Asked {
       return ExportCommand{read.recording, read.out};
     }},
    {"capture", "Take pictures along a camera path: colour, depth, ids", addCapturing,
     [](const CLI::App&, const Arguments& read) -> Asked {
       return CaptureCommand{modelFrom(read.model),
                             read.capture.path,
                             read.capture.out,
                             picturesFrom(read.capture),
                             captureRunFrom(read.capture),
                             read.device};
     }},
    {"walk", "Run a walk script on a server", addWalkOnServer,
     [](const CLI::App&, const Arguments& read) -> Asked {
       return WalkCommand{read.script, read.out, *endpointFrom(read.connect), read.strict};
     }},
    {"doctor", "Try each device that could draw: is anything missing?", addDoctor,
     [](const CLI::App&, const Arguments& read) -> Asked { return read.doctor; }},
    {"inspect", "Tell what is in a scene or a recording, and what is wrong with it", addInspection,
     [](const CLI::App&, const Arguments& read) -> Asked {
       return InspectCommand{modelFrom(read.model), read.json, read.objects, read.strict,
                             read.plan};
     }},
};

}  // namespace

std::optional<Endpoint> endpointFrom(const std::string& text) {
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos || colon == 0) return std::nullopt;
  Endpoint endpoint{text.substr(0, colon), 0};
  const bool bracketed = endpoint.host.front() == '[' && endpoint.host.back() == ']';
  if (bracketed) endpoint.host = endpoint.host.substr(1, endpoint.host.size() - 2);
  if (endpoint.host.empty()) return std::nullopt;
  if (!bracketed && endpoint.host.find(':') != std::string::npos) return std::nullopt;
  const char* end = text.data() + text.size();
  const auto parsed = std::from_chars(text.data() + colon + 1, end, endpoint.port);
  if (parsed.ec != std::errc() || parsed.ptr != end) return std::nullopt;
  return endpoint;
}

std::variant<ProgramCommand, ExitCode> readCommandLine(int argc, const char* const* argv) {
  CLI::App app("Enfilade: virtual walk-throughs without a display", "enfilade");
  app.require_subcommand(1);
  app.set_version_flag("--version", std::string("enfilade ") + kServerVersion);
  Arguments read;
  const std::string_view asked = argc > 1 ? argv[1] : "";
  for (const Verb& verb : kVerbs) {
    CLI::App* added = app.add_subcommand(verb.name, verb.does);
    // The options of all verbs together take half a millisecond.
    if (asked == verb.name) verb.addOptions(*added, read);
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success)) {
      app.exit(error);
      if (std::cout.flush()) return ExitCode::done;
      std::cerr << "enfilade: stdout cannot be written\n";
      return ExitCode::runtimeError;
    }
    const auto verbs = app.get_subcommands();
    std::cerr << "enfilade: " << error.what() << "\n"
              << "enfilade " << (verbs.empty() ? "" : verbs[0]->get_name() + " ")
              << "--help tells what there is\n";
    return ExitCode::usage;
  }
  const CLI::App& verb = *app.get_subcommands().front();
  const auto named = [&](const Verb& one) { return verb.get_name() == one.name; };
  return std::find_if(std::begin(kVerbs), std::end(kVerbs), named)->commandFrom(verb, read);
}

}  // namespace enfilade::server
