#include "server/command_line.hpp"

#include <CLI/CLI.hpp>
#include <charconv>

#include "scene/audit.hpp"
#include "scene/import_model.hpp"

namespace enfilade::server {
namespace {

/// Where CLI11 leaves what it read; every verb has its own.
struct ModelArguments {
  std::string file, unit, up, ifcReader = "auto";
  bool noCache = false;
};
struct Arguments {
  ModelArguments model;
  std::string script, out, plan, listen = "127.0.0.1:7878", connect;
  bool strict = false, json = false, objects = false;
  std::uint32_t auditEvery = 0;
};

std::string unitProblem(const std::string& text) {
  if (scene::metresPerUnitFrom(text)) return {};
  return text + ": give m, mm, cm, ft, in or a positive number of metres";
}

std::string folderProblem(const std::string& text) {
  return text.empty() ? "the folder's name is empty: give one, as out" : "";
}

std::string endpointProblem(const std::string& text) {
  if (endpointFrom(text)) return {};
  return text + ": give HOST:PORT, as 127.0.0.1:7878, with a port from 0 to 65535";
}

std::string auditProblem(const std::string& text) {
  const char* end = text.data() + text.size();
  std::uint32_t ticks = 0;
  const auto parsed = std::from_chars(text.data(), end, ticks);
  const bool whole = parsed.ec == std::errc() && parsed.ptr == end;
  if (whole && ticks <= scene::kSparsestAudit) return {};
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

void addModel(CLI::App& verb, ModelArguments& into) {
  verb.add_option("SCENE", into.file, "The model: glTF, GLB, OBJ, COLLADA, FBX, IFC, IFCZIP")
      ->required();
  verb.add_option("--unit", into.unit, "Length of the file's unit: m, mm, cm, ft, in or metres")
      ->check(CLI::Validator(unitProblem, "UNIT"));
  verb.add_option("--up", into.up, "The file's up axis")->check(CLI::IsMember({"x", "y", "z"}));
  verb.add_flag("--no-cache", into.noCache,
                "Import the model even if an earlier start kept what it made of it");
  verb.add_option(
          "--ifc-reader", into.ifcReader,
          "Who reads IFC. auto: web-ifc; ifcplusplus where that fails or Node.js is missing "
          "and for products that it leaves out; assimp last")
      ->capture_default_str()
      ->check(CLI::IsMember({"auto", "web-ifc", "ifcplusplus", "assimp"}));
}

void addWalk(CLI::App& verb, Arguments& into) {
  verb.add_option("SCRIPT", into.script, "The walk: JSON lines, see protocol/SCRIPT.md")
      ->required();
  verb.add_option("--out", into.out, "Folder for the pictures, contacts and summary")
      ->required()
      ->check(CLI::Validator(folderProblem, "DIR"));
  verb.add_flag("--strict", into.strict, "End with 3 when an order was refused or a walk blocked");
}

void addInspect(CLI::App& verb, Arguments& into) {
  verb.add_flag("--json", into.json, "Tell it as one JSON object");
  verb.add_flag("--objects", into.objects, "List every object too: id, path, box, class");
  verb.add_flag("--strict", into.strict, "End with 3 when there are problems");
  verb.add_option("--plan", into.plan, "Folder for a picture of the plan of each storey")
      ->check(CLI::Validator(folderProblem, "DIR"));
}

ModelOptions modelFrom(const ModelArguments& read) {
  ModelOptions options;
  options.file = read.file;
  options.cache = !read.noCache;
  if (!read.unit.empty()) options.metresPerUnit = scene::metresPerUnitFrom(read.unit);
  if (!read.up.empty()) options.up = read.up.front();
  options.ifcReader = scene::ifcReaderFrom(read.ifcReader).value_or(scene::IfcReader::automatic);
  return options;
}

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
  Arguments read;
  CLI::App* serve = app.add_subcommand("serve", "Serve a scene to clients over TCP");
  addModel(*serve, read.model);
  serve->add_option("--listen", read.listen, "Address and port; port 0 lets the system choose")
      ->capture_default_str()
      ->check(CLI::Validator(endpointProblem, "HOST:PORT"));
  addAudit(*serve, read);
  CLI::App* replay = app.add_subcommand("replay", "Run a walk script in a scene, in process");
  addModel(*replay, read.model);
  addWalk(*replay, read);
  addAudit(*replay, read);
  CLI::App* walk = app.add_subcommand("walk", "Run a walk script on a server");
  addWalk(*walk, read);
  walk->add_option("--connect", read.connect, "The server's address and port")
      ->required()
      ->check(CLI::Validator(endpointProblem, "HOST:PORT"));
  CLI::App* inspect =
      app.add_subcommand("inspect", "Tell what is in a scene, and what is wrong with it");
  addModel(*inspect, read.model);
  addInspect(*inspect, read);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success)) {
      app.exit(error);
      return ExitCode::done;
    }
    std::cerr << error.what() << "\n\n" << app.help();
    return ExitCode::usage;
  }
  if (*serve)
    return ServeCommand{modelFrom(read.model), *endpointFrom(read.listen), read.auditEvery};
  if (*replay) {
    return ReplayCommand{modelFrom(read.model), read.script, read.out, read.strict,
                         read.auditEvery};
  }
  if (*inspect)
    return InspectCommand{modelFrom(read.model), read.json, read.objects, read.strict, read.plan};
  return WalkCommand{read.script, read.out, *endpointFrom(read.connect), read.strict};
}

}  // namespace enfilade::server
