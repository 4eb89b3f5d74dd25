#include "server/commands/route.hpp"

#include <fmt/core.h>

#include <charconv>
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
      "{}: '{}' is neither a point X,Y,Z nor the name of a room, a storey, an object or a body; "
      "`enfilade inspect --objects` lists the names",
      argument, text));
}

/// A point of the place, on the island of `from` if it has any. Throws std::runtime_error, which
/// names the argument.
Vec3 resolvePlace(const Place& place, const std::string& text, const char* argument,
                  scene::Navigation& navigation, const std::optional<Vec3>& from) {
  if (const auto* point = std::get_if<Vec3>(&place)) return *point;
  if (const auto free =
          navigation.findPlaceIn(std::get<std::vector<scene::NamedPlace>>(place), from))
    return *free;
  throw std::runtime_error(
      fmt::format("{}: there is no free place to stand at '{}'", argument, text));
}

Json toJson(const Vec3& point) {
  return Json::array({point.x(), point.y(), point.z()});
}

const char* toString(scene::PathLeg::Kind kind) {
  switch (kind) {
    case scene::PathLeg::Kind::drop:
      return "drop";
    case scene::PathLeg::Kind::lift:
      return "lift";
    case scene::PathLeg::Kind::aside:
      return "aside";
    case scene::PathLeg::Kind::walk:
      return "walk";
  }
  return "";
}

Json makeLegs(const scene::NavigationPath& path, const scene::Scene& scene) {
  Json legs = Json::array();
  for (const scene::PathLeg& leg : path.legs) {
    Json one{{"kind", toString(leg.kind)},
             {"first", leg.first},
             {"length", leg.length},
             {"seconds", leg.seconds}};
    if (leg.kind == scene::PathLeg::Kind::lift) {
      one["name"] = scene.model().bodies[leg.body].name;
      one["from_level"] = leg.fromLevel;
      one["to_level"] = leg.toLevel;
    }
    legs.push_back(std::move(one));
  }
  return legs;
}

Json makeReport(const RouteCommand& command, const scene::NavigationPath& path,
                const std::optional<scene::NarrowPlace>& narrowest,
                const std::vector<scene::DoorOnPath>& doors, const scene::Scene& scene,
                scene::Navigation& navigation) {
  const scene::NavigationReport mesh = navigation.report();
  Json report{{"found", path.found()}};
  if (path.found()) {
    report["length"] = path.length;
    report["seconds"] = path.seconds;
    report["points"] = Json::array();
    for (const Vec3& point : path.points) report["points"].push_back(toJson(point));
    report["legs"] = makeLegs(path, scene);
    report["doors"] = Json::array();
    for (const scene::DoorOnPath& door : doors)
      report["doors"].push_back({{"name", scene.model().bodies[door.body].name},
                                 {"distance", door.distance},
                                 {"seconds_to_open", door.secondsToOpen}});
    if (narrowest)
      report["narrowest"] = {{"at", toJson(narrowest->position)},
                             {"clear_width", narrowest->clearWidth}};
    else
      report["narrowest"] = nullptr;
  } else {
    report["reason"] = path.reason;
    if (path.obstruction)
      report["obstruction"] = {
          {"entity", navigation.findEntityName(path.obstruction->entity)},
          {"at", toJson(path.obstruction->position)},
          {"clear_width",
           path.obstruction->clearWidth > 0 ? Json(path.obstruction->clearWidth) : Json(nullptr)}};
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

std::string formatText(const RouteCommand& command, const scene::NavigationPath& path,
                       const std::optional<scene::NarrowPlace>& narrowest,
                       const std::vector<scene::DoorOnPath>& doors, const scene::Scene& scene) {
  if (!path.found())
    return fmt::format("no way from {} to {}: {}\n", command.from, command.to, path.reason);
  std::string text = fmt::format("{:.2f} m from {} to {}, {:.1f} s at {:.1f} m/s\n", path.length,
                                 command.from, command.to, path.seconds, command.agent.speed);
  if (narrowest)
    text += fmt::format("narrowest: {:.3f} m at {:.2f}, {:.2f}, {:.2f}\n", narrowest->clearWidth,
                        narrowest->position.x(), narrowest->position.y(), narrowest->position.z());
  for (const scene::PathLeg& leg : path.legs)
    if (leg.kind == scene::PathLeg::Kind::drop)
      text += fmt::format("drop: {:.2f} m\n",
                          path.points[leg.first].y() - path.points[leg.first + 1].y());
    else if (leg.kind == scene::PathLeg::Kind::lift)
      text +=
          fmt::format("lift: {}, from stop {} to {}, {:.1f} s\n",
                      scene.model().bodies[leg.body].name, leg.fromLevel, leg.toLevel, leg.seconds);
  for (const scene::DoorOnPath& door : doors)
    text += fmt::format("door: {}, after {:.2f} m\n", scene.model().bodies[door.body].name,
                        door.distance);
  for (const Vec3& point : path.points)
    text += fmt::format("  {:9.3f} {:9.3f} {:9.3f}\n", point.x(), point.y(), point.z());
  return text;
}

/// The path as an avatar's positions, dense enough for a map.
WalkedPath makeWalkedPath(const scene::NavigationPath& path) {
  constexpr double kSpacing = 0.05;  // metres
  WalkedPath walked{"route", {}, 1};
  for (std::size_t i = 1; i < path.points.size(); ++i) {
    const Vec3 leg = path.points[i] - path.points[i - 1];
    const int count = std::max(1, static_cast<int>(leg.norm() / kSpacing));
    for (int k = 0; k < count; ++k)
      walked.footPositions.push_back(path.points[i - 1] + (static_cast<double>(k) / count) * leg);
  }
  walked.footPositions.push_back(path.points.back());
  return walked;
}

void writePlan(const std::shared_ptr<const scene::Scene>& scene,
               const std::shared_ptr<const scene::Snapshot>& snapshot,
               const scene::NavigationPath& path, const RouteCommand& command) {
  render::RendererSelector renderer(scene);
  WalkTrace trace;
  trace.title = fmt::format("{} to {}: {:.2f} m", command.from, command.to, path.length);
  trace.paths.push_back(makeWalkedPath(path));
  trace.floors = {path.points.front().y(), path.points.back().y()};
  if (const auto image = drawMap(trace, {makePlanRenderer(renderer, snapshot), scene.get()})) {
    render::writePng(command.plan, *image);
    logInfo("plan: {}", command.plan.string());
  }
}

}  // namespace

ExitCode route(const RouteCommand& command) {
  const auto scene = loadScene(command.model);
  // Before the meshes, whose building takes long.
  const Place start = parsePlace(command.from, "FROM", *scene, command.agent.radius);
  const Place goal = parsePlace(command.to, "TO", *scene, command.agent.radius);
  const auto snapshot = command.doorsAsTheyAre
                            ? scene::World(scene, command.settings).snapshot()
                            : scene::makeSnapshotWithOpenDoors(scene, command.settings);
  Progress bar;
  const int threads = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  const auto made = makeNavigation(
      {scene, command.settings, command.agent, !command.doorsAsTheyAre, snapshot, threads},
      [&](double done) { bar.show(done, "navigation mesh"); });
  scene::Navigation& navigation = *made;
  bar.clear();
  const Vec3 from = resolvePlace(start, command.from, "FROM", navigation, std::nullopt);
  const Vec3 to = resolvePlace(goal, command.to, "TO", navigation, from);
  scene::NavigationPath path = navigation.findPath(from, to, command.links);
  const auto narrowest =
      path.found() ? navigation.findNarrowest(path.points) : std::optional<scene::NarrowPlace>();
  scene::EntityIndex index(scene);
  const std::vector<scene::DoorOnPath> doors =
      path.found() && !command.doorsAsTheyAre
          ? scene::findDoorsOnPath(index, command.settings,
                                   *scene::World(scene, command.settings).snapshot(), command.agent,
                                   path.points)
          : std::vector<scene::DoorOnPath>();
  path.seconds += scene::computeOpeningSeconds(doors);
  constexpr auto kReplace = Json::error_handler_t::replace;
  writeToStdout(command.json ? makeReport(command, path, narrowest, doors, *scene, navigation)
                                       .dump(-1, ' ', false, kReplace) +
                                   "\n"
                             : formatText(command, path, narrowest, doors, *scene),
                "the path was found");
  if (path.found() && !command.plan.empty()) writePlan(scene, snapshot, path, command);
  return path.found() ? ExitCode::success : ExitCode::violations;
}

}  // namespace enfilade::server
