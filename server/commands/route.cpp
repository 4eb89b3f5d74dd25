#include "server/commands/route.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <thread>
#include <variant>
#include <vector>

#include "render/service/renderer_selector.hpp"
#include "scene/navigation/doors.hpp"
#include "scene/navigation/navigation.hpp"
#include "scene/navigation/place_names.hpp"
#include "server/base/progress.hpp"
#include "server/base/standard_output.hpp"
#include "server/log/log.hpp"
#include "server/messages/world_messages.hpp"
#include "server/navigation/path_answer.hpp"
#include "server/navigation/shared_meshes.hpp"
#include "server/plans/path_map.hpp"

namespace enfilade::server {
namespace {

using Json = nlohmann::ordered_json;
using scene::Vec3;

std::optional<Vec3> parsePoint(const std::string& text) {
  Vec3 point;
  const char* at = text.data();
  const char* const end = at + text.size();
  for (int axis = 0; axis < 3; ++axis) {
    if (axis > 0 && (at == end || *at++ != ',')) return std::nullopt;
    const auto [next, error] = std::from_chars(at, end, point[axis]);
    if (error != std::errc()) return std::nullopt;
    at = next;
  }
  return at == end && point.allFinite() ? std::optional(point) : std::nullopt;
}

using Place = std::variant<Vec3, std::vector<scene::NamedPlace>>;

/// The place that an argument means. Throws std::runtime_error, which names the argument.
Place parsePlace(const std::string& text, const char* argument, const scene::Scene& scene,
                 double radius) {
  constexpr double kNextTo = 1;  // metres from an object
  if (const auto point = parsePoint(text)) return *point;
  if (auto named = scene::findNamedPlaces(scene, text, radius + kNextTo); !named.empty())
    return named;
  throw std::runtime_error(fmt::format(
      "{}: '{}' is neither a point X,Y,Z nor the name of a room, a storey, an object or a body "
      "of known extent; `enfilade inspect --objects` lists the names",
      argument, text));
}

/// A point of the place, on the island of `from` if it has any. Throws std::runtime_error, which
/// names the argument.
Vec3 resolvePlace(const Place& place, const std::string& text, const char* argument,
                  scene::Navigation& navigation,
                  const std::function<scene::Navigation&()>& withOpenDoors,
                  const std::optional<Vec3>& from) {
  if (const auto* point = std::get_if<Vec3>(&place)) return *point;
  if (const auto free = findPlaceIn(navigation, withOpenDoors,
                                    std::get<std::vector<scene::NamedPlace>>(place), from))
    return *free;
  throw std::runtime_error(
      fmt::format("{}: there is no free place to stand at '{}'", argument, text));
}

Json toJson(const v1::Vec3& point) {
  return Json::array({point.x(), point.y(), point.z()});
}

const char* toString(v1::NavigationLeg::Kind kind) {
  switch (kind) {
    case v1::NavigationLeg::KIND_DOOR:
      return "door";
    case v1::NavigationLeg::KIND_DROP:
      return "drop";
    case v1::NavigationLeg::KIND_LIFT:
      return "lift";
    case v1::NavigationLeg::KIND_ASIDE:
      return "aside";
    default:
      return "walk";
  }
}

Json makeLegs(const v1::NavigationPath& path) {
  Json legs = Json::array();
  for (const v1::NavigationLeg& leg : path.legs()) {
    Json one{{"kind", toString(leg.kind())},
             {"first", leg.first()},
             {"length", leg.length()},
             {"seconds", leg.seconds()}};
    if (!leg.name().empty()) one["name"] = leg.name();
    if (leg.kind() == v1::NavigationLeg::KIND_LIFT) {
      one["from_level"] = leg.from_level();
      one["to_level"] = leg.to_level();
    }
    legs.push_back(std::move(one));
  }
  return legs;
}

Json makeReport(const RouteCommand& command, const v1::NavigationPath& path,
                const scene::NavigationReport& mesh) {
  Json report{{"found", path.found()}};
  if (path.found()) {
    report["length"] = path.length();
    report["seconds"] = path.seconds();
    report["points"] = Json::array();
    for (const v1::Vec3& point : path.points()) report["points"].push_back(toJson(point));
    report["legs"] = makeLegs(path);
    report["doors"] = Json::array();
    for (const v1::NavigationDoor& door : path.doors())
      report["doors"].push_back({{"name", door.name()},
                                 {"distance", door.distance()},
                                 {"seconds_to_open", door.seconds()}});
    report["narrowest"] = nullptr;
    if (path.has_narrowest_at())
      report["narrowest"] = {{"at", toJson(path.narrowest_at())},
                             {"clear_width", path.clear_width()}};
    report["steps"] = Json::array();
    for (const v1::NavigationPath::Step& step : path.steps())
      report["steps"].push_back({{"at", toJson(step.at())}, {"rise", step.rise()}});
  } else {
    report["reason"] = path.reason();
    if (path.has_obstacle_at() || path.obstacle() != 0)
      report["obstruction"] = {
          {"entity", path.obstacle_name()},
          {"at", path.has_obstacle_at() ? toJson(path.obstacle_at()) : Json(nullptr)},
          {"clear_width", path.clear_width() > 0 ? Json(path.clear_width()) : Json(nullptr)}};
  }
  report["agent"] = {{"radius", command.agent.radius},
                     {"height", command.agent.height},
                     {"step_height", command.settings.stepHeight}};
  report["mesh"] = {{"seconds", mesh.seconds},
                    {"area", mesh.area},
                    {"islands", mesh.islandAreas.size()},
                    {"bytes", mesh.bytes}};
  return report;
}

/// Metres with two digits; never -0.00.
std::string formatPlace(const v1::Vec3& at) {
  const auto round = [](double metres) { return std::round(100 * metres) / 100 + 0.0; };
  return fmt::format("{:.2f}, {:.2f}, {:.2f}", round(at.x()), round(at.y()), round(at.z()));
}

double getHeight(const v1::NavigationPath::Step& step) {
  return std::abs(step.rise());
}

std::string formatText(const RouteCommand& command, const v1::NavigationPath& path) {
  if (!path.found())
    return fmt::format("no path from {} to {}: {}\n", command.from, command.to, path.reason());
  std::string text = fmt::format("{:.2f} m from {} to {}, {:.1f} s at {:.1f} m/s\n", path.length(),
                                 command.from, command.to, path.seconds(), command.agent.speed);
  if (path.has_narrowest_at())
    text += fmt::format("narrowest: {:.3f} m at {}\n", path.clear_width(),
                        formatPlace(path.narrowest_at()));
  const auto highest = std::ranges::max_element(path.steps(), {}, getHeight);
  if (highest != path.steps().end())
    text += fmt::format("steps: {}, the highest {:.3f} m at {}\n", path.steps_size(),
                        getHeight(*highest), formatPlace(highest->at()));
  for (const v1::NavigationLeg& leg : path.legs()) {
    const int first = static_cast<int>(leg.first());
    if (leg.kind() == v1::NavigationLeg::KIND_DROP)
      text += fmt::format("drop: {:.2f} m\n", path.points(first).y() - path.points(first + 1).y());
    else if (leg.kind() == v1::NavigationLeg::KIND_LIFT)
      text += fmt::format("lift: {}, from stop {} to {}, {:.1f} s\n", leg.name(), leg.from_level(),
                          leg.to_level(), leg.seconds());
  }
  for (const v1::NavigationDoor& door : path.doors())
    text += fmt::format("door: {}, after {:.2f} m, opens in {:.1f} s\n", door.name(),
                        door.distance(), door.seconds());
  for (const v1::Vec3& point : path.points())
    text += fmt::format("  {:9.3f} {:9.3f} {:9.3f}\n", point.x(), point.y(), point.z());
  return text;
}

/// The path as an avatar's positions, dense enough for a map.
WalkedPath makeWalkedPath(const v1::NavigationPath& path) {
  constexpr double kSpacing = 0.05;  // metres
  WalkedPath walked{"start", {}, 1};
  const auto at = [&](int i) { return vectorFromProto(path.points(i)); };
  for (int i = 1; i < path.points_size(); ++i) {
    const Vec3 leg = at(i) - at(i - 1);
    const int count = std::max(1, static_cast<int>(leg.norm() / kSpacing));
    for (int k = 0; k < count; ++k)
      walked.footPositions.push_back(at(i - 1) + (static_cast<double>(k) / count) * leg);
  }
  walked.footPositions.push_back(at(path.points_size() - 1));
  return walked;
}

/// The path, or both ends and what is in the way.
WalkTrace makeTrace(const RouteCommand& command, const v1::NavigationPath& path, const Vec3& from,
                    const Vec3& to) {
  WalkTrace trace;
  trace.floors = {from.y(), to.y()};
  if (path.found()) {
    trace.title = fmt::format("{} to {}: {:.2f} m", command.from, command.to, path.length());
    trace.paths = {makeWalkedPath(path), {"goal", {to}, 2}};
    return trace;
  }
  trace.title = fmt::format("no path from {} to {}: {}", command.from, command.to, path.reason());
  trace.paths = {{"start", {from}, 1}, {"goal", {to}, 2}};
  if (path.has_obstacle_at()) {
    trace.floors.push_back(path.obstacle_at().y());
    trace.blockedWalks.push_back({vectorFromProto(path.obstacle_at()), Vec3::UnitY()});
  }
  return trace;
}

void writePlan(const std::shared_ptr<const scene::Scene>& scene,
               const std::shared_ptr<const scene::Snapshot>& snapshot, const WalkTrace& trace,
               const std::filesystem::path& file) {
  render::RendererSelector renderer(scene);
  const auto image =
      drawMap(trace, {makePlanRenderer(renderer, snapshot), makeFloorPlanSource(scene)});
  if (!image) throw std::runtime_error("the plan cannot be drawn: " + file.string());
  render::writePng(file, *image);
  logInfo("plan: {}", file.string());
}

}  // namespace

ExitCode route(const RouteCommand& command) {
  const auto scene = loadScene(command.model);
  // Before the meshes, whose building takes long.
  const Place start = parsePlace(command.from, "FROM", *scene, command.agent.radius);
  const Place goal = parsePlace(command.to, "TO", *scene, command.agent.radius);
  const auto asFile = scene::World(scene, command.settings).snapshot();
  std::shared_ptr<const scene::Snapshot> opened;  // once it is needed: doors take their time
  Progress bar;
  const auto showProgress = [&](double done) { bar.show(done, "navigation mesh"); };
  const int threads = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  std::unique_ptr<scene::Navigation> asTheyAre, withOpenDoors;
  const auto provide = [&](bool open) -> scene::Navigation& {
    std::unique_ptr<scene::Navigation>& made = open ? withOpenDoors : asTheyAre;
    if (open && !opened) opened = scene::makeSnapshotWithOpenDoors(scene, command.settings);
    if (!made)
      made = makeNavigation(
          {scene, command.settings, command.agent, open, open ? opened : asFile, threads},
          showProgress);
    bar.clear();
    return *made;
  };
  const bool doorsOpen = !command.doorsAsTheyAre;
  scene::Navigation& navigation = provide(doorsOpen);
  std::function<scene::Navigation&()> open;
  if (scene::hasDoors(*scene)) open = [&]() -> scene::Navigation& { return provide(true); };
  const auto onlyIfClosed = doorsOpen ? nullptr : open;
  const Vec3 from = resolvePlace(start, command.from, "FROM", navigation, nullptr, std::nullopt);
  const Vec3 to = resolvePlace(goal, command.to, "TO", navigation, onlyIfClosed, from);
  scene::EntityIndex index(scene);
  ClosedDoors closedDoors;
  PathAnswer answer{*scene,
                    navigation,
                    *asFile,
                    command.settings,
                    doorsOpen,
                    open,
                    [&]() -> scene::Navigation& { return provide(false); },
                    [&]() -> scene::EntityIndex& { return index; },
                    closedDoors,
                    showProgress,
                    "leave out --doors-as-they-are, or open it in the model"};
  v1::NavigationPath path;
  writePath(answer, from, to, command.links, {.narrowest = true, .steps = true}, path);
  bar.clear();
  constexpr auto kReplace = Json::error_handler_t::replace;
  writeToStdout(
      command.json
          ? makeReport(command, path, navigation.report()).dump(-1, ' ', false, kReplace) + "\n"
          : formatText(command, path),
      path.found() ? "the path was found" : "no path was found");
  if (!command.plan.empty())
    writePlan(scene, doorsOpen ? opened : asFile, makeTrace(command, path, from, to), command.plan);
  return path.found() ? ExitCode::success : ExitCode::violations;
}

}  // namespace enfilade::server
