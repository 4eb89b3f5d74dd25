#include "server/app/command_line.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>

#include "protocol/mcap/reader.hpp"
#include "protocol/nearest_word.hpp"
#include "server/app/command_arguments.hpp"
#include "server/app/help_formatter.hpp"
#include "server/app/parse_errors.hpp"
#include "server/base/parse_number.hpp"
#include "server/base/server_limits.hpp"
#include "server/base/version.hpp"

namespace enfilade::server {
namespace {

/// The recording is the last argument. The scene, if given, comes before it.
VerifyCommand makeVerifyCommand(const CommandArguments& read) {
  const bool named = !read.script.empty();
  VerifyCommand command{
      named ? read.model.file : "", named ? read.script : read.model.file, !read.model.noCache, {}};
  if (!read.from.empty()) command.from = parseNumber<std::uint64_t>(read.from);
  if (!read.run.empty()) command.run = parseNumber<std::uint32_t>(read.run);
  return command;
}

/// Applies --then: a script takes over from a recording.
void applyBranch(const CommandArguments& read, ReplayCommand& command) {
  const VerifyCommand recorded = makeVerifyCommand(read);
  command.model.file = recorded.scene;
  command.recording = recorded.recording;
  command.script = read.then;
  command.from = recorded.from.value_or(0);
  command.run = recorded.run.value_or(1);
}

/// Rejects options whose values come from the recording. Empty: none was given.
std::string validateRecordedOptions(const CLI::App& verb) {
  for (const char* option : {"--step-height", "--epsilon", "--slope", "--speed-limit", "--sliding",
                             "--near-miss", "--unit", "--up", "--ifc-reader", "--ifc-doors",
                             "--georeference", "--gltf-scene", "--ignore-appearance"})
    if (verb.count(option) > 0)
      return std::string(option) +
             " cannot be given: the recording "
             "sets it";
  return "";
}

ExitCode reportMisuse(const char* verb, const std::string& problem) {
  std::cerr << "enfilade: " << problem << "\nenfilade " << verb << " --help lists the options\n";
  return ExitCode::usageError;
}

bool isResimulation(const CommandArguments& read) {
  return !read.verify && read.then.empty() && protocol::mcap::isMcap(read.script);
}

/// Rejects option combinations that a replay of a recording does not support. Empty: valid.
std::string validateBranch(const CLI::App& replay, const CommandArguments& read) {
  if (!read.run.empty() && !read.verify && read.then.empty() && !isResimulation(read))
    return "--run needs a recording: --verify, --then SCRIPT, or SCENE RECORDING";
  if (read.from.empty()) return read.then.empty() ? "" : "--then needs --from TICK";
  if (read.then.empty() && !read.verify)
    return "--from needs --verify, or --then SCRIPT that continues from there";
  if (!read.then.empty() && read.verify)
    return "--then creates a new walk, which --verify "
           "cannot check: give one of them";
  return validateRecordedOptions(replay);
}

/// Rejects options that `serve` does not support with, or without, a recording. Empty: valid.
std::string validatePlayback(const CLI::App& serve, const ServeCommand& command) {
  if (command.recording.empty())
    return command.from || serve.count("--run") > 0
               ? "--from and --run need a recording instead of SCENE"
               : "";
  for (const std::filesystem::path& further : command.furtherScenes)
    if (protocol::mcap::isMcap(further))
      return further.string() +
             ": a server plays only one recording: `serve RECORDING [FURTHER..]`, or "
             "`serve SCENE RECORDING` for another scene";
  return validateRecordedOptions(serve);
}

/// The recording replaces the scene argument, or is the first argument after it.
void applyPlayback(const CommandArguments& read, ServeCommand& command) {
  using protocol::mcap::isMcap;
  if (!read.from.empty()) command.from = parseNumber<std::uint64_t>(read.from);
  command.run = parseNumber<std::uint32_t>(read.run).value_or(1);
  if (isMcap(command.model.file)) {
    command.recording = std::exchange(command.model.file, {});
  } else if (!command.furtherScenes.empty() && isMcap(command.furtherScenes.front())) {
    command.recording = std::move(command.furtherScenes.front());
    command.furtherScenes.erase(command.furtherScenes.begin());
  }
}

std::uint32_t parseSamples(const CommandArguments& read) {
  return parseNumber<std::uint32_t>(read.samples).value_or(kCaptureSamples);
}

std::uint32_t parseAudit(const CommandArguments& read) {
  return parseNumber<std::uint32_t>(read.auditEvery).value_or(0);
}

std::variant<ProgramCommand, ExitCode> makeServeCommand(const CLI::App& serve,
                                                        const CommandArguments& read) {
  const std::size_t worlds = 1 + read.furtherScenes.size(), maxWorlds = ServerLimits{}.worlds;
  if (worlds > maxWorlds) {
    std::cerr << "enfilade: serve: " << worlds << " scenes exceed the limit of " << maxWorlds
              << " worlds per server: give fewer, or start another server\n";
    return ExitCode::usageError;
  }
  ServeCommand command{makeModelOptions(read.model),
                       *parseHostPort(read.listen),
                       parseAudit(read),
                       makeWorldSettings(read),
                       read.tokenFile,
                       read.access,
                       read.stopAtEndOfInput,
                       makeDrawingOptions(read),
                       read.furtherScenes,
                       makeRecordingChoice(read)};
  applyPlayback(read, command);
  if (const std::string problem = validatePlayback(serve, command); !problem.empty())
    return reportMisuse("serve", problem);
  return command;
}

/// Rejects options that a re-simulation in another model does not support. Empty: valid.
std::string validateResimulate(const CLI::App& replay) {
  for (const char* option :
       {"--strict", "--audit", "--samples", "--step-height", "--epsilon", "--slope",
        "--speed-limit", "--sliding", "--near-miss", "--record-channels", "--record-frames"})
    if (replay.count(option) > 0)
      return std::string(option) + " cannot be given: a re-simulation uses the recorded values";
  return "";
}

ResimulateCommand makeResimulateCommand(const CommandArguments& read) {
  return {makeModelOptions(read.model),
          read.script,
          read.out,
          read.record.file,
          read.tolerance,
          read.json,
          read.pictures,
          makeDrawingOptions(read),
          parseNumber<std::uint32_t>(read.run).value_or(1)};
}

/// Reports a missing argument of a replay without --verify.
std::optional<std::string> findMissingArgument(const CommandArguments& read) {
  if (read.script.empty() && read.then.empty() && protocol::mcap::isMcap(read.model.file))
    return "SCENE is required: the model for the re-simulation; only --verify and "
           "`enfilade export` accept a recording without a scene";
  if (read.script.empty() && read.then.empty())
    return "SCRIPT is required: a walk script, JSON lines (protocol/SCRIPT.md)";
  if (read.out.empty())
    return "--out is required: the output folder for pictures, contacts and "
           "summary";
  return std::nullopt;
}

std::variant<ProgramCommand, ExitCode> makeReplayCommand(const CLI::App& replay,
                                                         const CommandArguments& read) {
  std::string problem = validateBranch(replay, read);
  if (problem.empty() && isResimulation(read)) problem = validateResimulate(replay);
  if (problem.empty() && !read.verify) problem = findMissingArgument(read).value_or("");
  if (!problem.empty()) return reportMisuse("replay", problem);
  if (read.verify) return makeVerifyCommand(read);
  if (isResimulation(read)) return makeResimulateCommand(read);
  ReplayCommand command{makeModelOptions(read.model),
                        read.script,
                        read.out,
                        read.strict,
                        parseAudit(read),
                        makeWorldSettings(read),
                        makeRecordingChoice(read),
                        makeDrawingOptions(read)};
  command.samples = parseSamples(read);
  if (!read.then.empty()) applyBranch(read, command);
  return command;
}

/// The options that only the import of a model uses. Empty: none was given.
std::string findModelOption(const CLI::App& verb, const std::vector<const char*>& options) {
  for (const char* option : options)
    if (verb.count(option) > 0) return option;
  return "";
}

std::variant<ProgramCommand, ExitCode> makeExportReplayCommand(const CLI::App& verb,
                                                               const CommandArguments& read) {
  const VerifyCommand files = makeVerifyCommand(read);
  if (!protocol::mcap::isMcap(files.recording))
    return reportMisuse("export", files.recording.string() + ": not a recording; --html needs one");
  const std::string option =
      findModelOption(verb, {"--unit", "--up", "--offset", "--ifc-reader", "--ifc-doors",
                             "--georeference", "--gltf-scene", "--ignore-appearance"});
  if (!option.empty())
    return reportMisuse("export", option + " cannot be given: the recording sets it");
  return ExportReplayCommand{files.recording,       read.html,         files.scene,
                             files.run.value_or(1), read.maxMegabytes, files.cache};
}

/// A model becomes a GLB file, a recording becomes texts or a page: each has an option of its own.
std::variant<ProgramCommand, ExitCode> makeExportCommand(const CLI::App& verb,
                                                         const CommandArguments& read) {
  const bool writesScene = verb.count("--glb") > 0, writesPage = verb.count("--html") > 0;
  if (verb.count("--glb") + verb.count("--out") + verb.count("--html") != 1)
    return reportMisuse("export",
                        "give one of these: --glb FILE to export a model, --out DIR or --html FILE "
                        "to export a recording");
  if (writesPage) return makeExportReplayCommand(verb, read);
  if (const std::string option = findModelOption(verb, {"--run", "--max-size"}); !option.empty())
    return reportMisuse("export", option + " needs a recording and --html");
  if (!read.script.empty()) return reportMisuse("export", "two files need --html");
  if (writesScene && protocol::mcap::isMcap(read.model.file))
    return reportMisuse(
        "export", read.model.file + ": a recording: give --out DIR, or a model file for --glb");
  if (writesScene) return ExportSceneCommand{makeModelOptions(read.model), read.glb};
  const std::string option = findModelOption(
      verb, {"--unit", "--up", "--offset", "--no-cache", "--ifc-reader", "--ifc-doors",
             "--georeference", "--gltf-scene", "--ignore-appearance"});
  if (!option.empty()) return reportMisuse("export", option + " needs a model and --glb");
  return ExportCommand{read.model.file, read.out};
}

using ParsedCommand = std::variant<ProgramCommand, ExitCode>;

struct Verb {
  const char* name;
  const char* description;
  void (*addOptions)(CLI::App& verb, CommandArguments& into);
  ParsedCommand (*makeCommand)(const CLI::App& verb, const CommandArguments& read);
};

const Verb kVerbs[] = {
    {"serve", "Serve scenes or a recording to clients over TCP", addServeOptions, makeServeCommand},
    {"replay", "Run a walk script or a recorded walk in a scene", addReplayOptions,
     makeReplayCommand},
    {"diff", "Report the changes between two recorded walks", addDiffOptions,
     [](const CLI::App&, const CommandArguments& read) -> ParsedCommand {
       return DiffCommand{read.before, read.after, read.tolerance, read.json};
     }},
    {"export", "Export a scene as glTF, or a recording as texts or as a page", addExportOptions,
     makeExportCommand},
    {"capture", "Render colour, depth and ids along a camera path", addCaptureCommandOptions,
     [](const CLI::App&, const CommandArguments& read) -> ParsedCommand {
       return CaptureCommand{makeModelOptions(read.model),
                             read.capture.path,
                             read.capture.out,
                             makePictureOptions(read.capture),
                             makeCaptureRunOptions(read.capture),
                             read.device};
     }},
    {"walk", "Run a walk script on a server", addWalkOptions,
     [](const CLI::App&, const CommandArguments& read) -> ParsedCommand {
       return WalkCommand{read.script,       read.out,   *parseHostPort(read.connect),
                          read.world,        read.token, read.strict,
                          parseSamples(read)};
     }},
    {"doctor", "Test all graphics devices and report missing components", addDoctorOptions,
     [](const CLI::App&, const CommandArguments& read) -> ParsedCommand { return read.doctor; }},
    {"route", "Find a path that an avatar can walk", addRouteOptions,
     [](const CLI::App&, const CommandArguments& read) -> ParsedCommand {
       RouteCommand command = read.route;
       command.model = makeModelOptions(read.model);
       command.settings = makeWorldSettings(read);
       command.json = read.json;
       command.plan = read.plan;
       return command;
     }},
    {"inspect", "Report the contents and problems of a scene or a recording", addInspectOptions,
     [](const CLI::App& verb, const CommandArguments& read) -> ParsedCommand {
       if (read.planFormat == "png" && verb.count("--plan-scale") > 0)
         return reportMisuse("inspect", "--plan-scale needs --plan-format svg or pdf");
       return InspectCommand{makeModelOptions(read.model),
                             read.json,
                             read.objects,
                             read.strict,
                             read.accepted,
                             read.html,
                             read.plan,
                             read.planFormat,
                             read.planScale};
     }},
};

/// Error text for a first word that is no command.
std::string describeMissingVerb(std::string_view word) {
  std::vector<std::string> names;
  std::string list;
  for (const Verb& verb : kVerbs) {
    names.emplace_back(verb.name);
    list += (list.empty() ? "" : ", ") + names.back();
  }
  if (word.empty() || word.starts_with('-')) return "give a command: " + list;
  const std::string nearest = protocol::findNearestWord(word, names);
  return "unknown command '" + std::string(word.substr(0, 40)) + "'; " +
         (nearest.empty() ? "the commands are " + list : "did you mean '" + nearest + "'?");
}

}  // namespace

std::variant<ProgramCommand, ExitCode> readCommandLine(int argc, const char* const* argv) {
  CLI::App app("Enfilade: virtual walk-throughs without a display", "enfilade");
  app.require_subcommand(1);
  app.formatter(std::make_shared<HelpFormatter>());
  app.set_version_flag("--version,-v", formatVersion());
  CommandArguments read;
  const std::string_view requestedVerb = argc > 1 ? argv[1] : "";
  if (argc == 2 && requestedVerb == "help") {
    constexpr std::array<const char*, 2> kHelp{"enfilade", "--help"};
    return readCommandLine(2, kHelp.data());
  }
  if (argc == 3 && requestedVerb == "help") {
    if (std::ranges::find(kVerbs, std::string_view(argv[2]), &Verb::name) == std::end(kVerbs)) {
      std::cerr << "enfilade: " << describeMissingVerb(argv[2]) << "\n";
      return ExitCode::usageError;
    }
    const std::array<const char*, 3> help{"enfilade", argv[2], "--help"};
    return readCommandLine(3, help.data());
  }
  for (const Verb& verb : kVerbs) {
    CLI::App* added = app.add_subcommand(verb.name, verb.description);
    // Only this command's options are built: all of them take half a millisecond.
    if (requestedVerb == verb.name) verb.addOptions(*added, read);
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success)) {
      app.exit(error);
      if (std::cout.flush()) return ExitCode::success;
      std::cerr << "enfilade: cannot write to stdout\n";
      return ExitCode::runtimeError;
    }
    const auto verbs = app.get_subcommands();
    std::cerr << "enfilade: "
              << (verbs.empty() ? describeMissingVerb(requestedVerb)
                                : describeParseError(*verbs.front(), error))
              << "\n"
              << "enfilade " << (verbs.empty() ? "" : verbs[0]->get_name() + " ")
              << "--help lists the options\n";
    return ExitCode::usageError;
  }
  const CLI::App& verb = *app.get_subcommands().front();
  const auto named = [&](const Verb& one) { return verb.get_name() == one.name; };
  return std::find_if(std::begin(kVerbs), std::end(kVerbs), named)->makeCommand(verb, read);
}

}  // namespace enfilade::server
