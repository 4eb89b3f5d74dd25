#include "server/navigation/path_answer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "scene/navigation/doors.hpp"
#include "server/messages/world_messages.hpp"

namespace enfilade::server {
namespace {

using scene::Vec3;

constexpr double kHalfWall = 0.3;  // metres from the middle of a leaf to the faces of a thick wall

/// A path and another one from its end.
scene::NavigationPath join(scene::NavigationPath path, const scene::NavigationPath& next) {
  for (scene::PathLeg leg : next.legs) {
    leg.first += path.points.size() - 1;
    path.legs.push_back(leg);
  }
  path.points.insert(path.points.end(), next.points.begin() + 1, next.points.end());
  path.length += next.length;
  path.seconds += next.seconds;
  return path;
}

struct PathWriter {
  const PathAnswer& answer;

  std::vector<scene::DoorOnPath> findDoors(scene::Navigation& navigation,
                                           const scene::NavigationPath& path) const {
    if (!scene::hasDoors(answer.scene)) return {};  // saves building the index
    return scene::findDoorsOnPath(answer.index(), answer.settings, answer.snapshot,
                                  *navigation.agentShape(), path.points, path.legs);
  }

  bool isClosed(std::uint32_t door) const {
    return (*answer.snapshot.bodies)[door].jointPosition ==
           answer.scene.model().bodies[door].closedPosition;
  }

  /// The closed doors that stand on a path through open ones.
  void addDoors(const std::vector<scene::DoorOnPath>& doors, v1::NavigationPath& message) const {
    for (const scene::DoorOnPath& found : doors) {
      if (!found.isInTheWay) continue;
      const scene::BodySpec& spec = answer.scene.model().bodies[found.body];
      v1::NavigationDoor& door = *message.add_doors();
      door.set_id(spec.objects.front() + 1);
      door.set_name(spec.name);
      door.set_distance(found.distance);
      door.set_seconds(found.secondsToOpen);
      door.set_by_touch(spec.openedBy == scene::OpenedBy::touch);
    }
  }

  void addLeg(v1::NavigationLeg::Kind kind, std::size_t first, double length, double seconds,
              std::optional<std::uint32_t> body, v1::NavigationPath& message) const {
    v1::NavigationLeg& leg = *message.add_legs();
    leg.set_kind(kind);
    leg.set_first(static_cast<std::uint32_t>(first));
    leg.set_length(length);
    leg.set_seconds(seconds);
    message.set_seconds(message.seconds() + seconds);
    if (!body) return;
    const scene::BodySpec& spec = answer.scene.model().bodies[*body];
    leg.set_id(spec.objects.front() + 1);
    leg.set_name(spec.name);
    leg.set_by_touch(spec.openedBy == scene::OpenedBy::touch);
  }

  /// The doors on the path that touch an agent at `feet` when they open.
  std::vector<scene::DoorSwing> findSwings(const std::vector<scene::DoorOnPath>& doors,
                                           const Vec3& footPosition) const {
    std::vector<scene::DoorSwing> swings;
    for (const scene::DoorOnPath& door : doors) {
      if (!door.isInTheWay) continue;
      swings.emplace_back(answer.index(), answer.settings, answer.snapshot,
                          answer.navigation.agent(), door.body);
      if (!swings.back().touches(footPosition)) swings.pop_back();
    }
    return swings;
  }

  /// Lets a path that starts where doors on it sweep begin with a walk out of their way. Without
  /// one, or without a path from its end, the path counts as not found.
  void stepAside(const Vec3& to, const scene::PathOptions& options, scene::NavigationPath& path,
                 std::vector<scene::DoorOnPath>& doors) const {
    constexpr int kMaxTries = 4;  // the place aside may be in the way of other doors
    const Vec3 start = path.points.front();
    std::vector<scene::DoorSwing> swings, more = findSwings(doors, start);
    for (int tries = 0; !more.empty(); ++tries) {
      std::ranges::move(more, std::back_inserter(swings));
      scene::NavigationPath aside;
      if (tries < kMaxTries)
        aside = answer.asTheyAre().findPathOut(start, [&](const Vec3& footPosition) {
          return std::ranges::none_of(swings,
                                      [&](auto& swing) { return swing.touches(footPosition); });
        });
      if (!aside.reason.empty()) return;  // an agent can be there only when the doors are open
      scene::NavigationPath onwards =
          aside.found()
              ? answer.navigation.findPath(aside.points.back(), to, options, answer.progress)
              : scene::NavigationPath();
      if (!onwards.found()) {
        path = explainSwing(swings.back(), start, aside.found() ? onwards.reason : "");
        return;
      }
      doors = findDoors(answer.navigation, onwards);
      more = findSwings(doors, aside.points.back());
      for (scene::DoorOnPath& door : doors) {
        door.point += aside.points.size() - 1;
        door.distance += aside.length;
      }
      path = join(std::move(aside), onwards);
    }
  }

  /// A path that is not found because a door sweeps over its start. `reason`: why no path leads on
  /// from a place aside; "": no such place exists.
  scene::NavigationPath explainSwing(const scene::DoorSwing& swing, const Vec3& start,
                                     const std::string& reason) const {
    scene::NavigationPath path;
    path.obstruction = scene::Obstruction{swing.spec().objects.front() + 1, start, 0};
    path.reason =
        "the door '" + swing.spec().name + "' opens over the start, and " +
        (reason.empty() ? "there is no room to step aside" : "from a place aside " + reason);
    return path;
  }

  /// The parts of a walk before, at and after its doors.
  void addWalk(const scene::NavigationPath& path, const scene::PathLeg& walk, std::size_t end,
               const std::vector<scene::DoorOnPath>& doors, v1::NavigationPath& message) const {
    const double speed = answer.navigation.agent().speed;
    const auto computeLength = [&](std::size_t from, std::size_t to) {
      double length = 0;
      for (std::size_t i = from; i < to; ++i)
        length += (path.points[i + 1] - path.points[i]).norm();
      return length;
    };
    std::size_t at = walk.first;
    const auto walkTo = [&](std::size_t point) {
      if (point == at) return;
      const double length = computeLength(at, point);
      addLeg(v1::NavigationLeg::KIND_WALK, at, length, length / speed, std::nullopt, message);
      at = point;
    };
    for (std::size_t i = 0; i < doors.size(); ++i) {
      const scene::DoorOnPath& door = doors[i];
      if (door.point < at || door.point >= end) continue;
      walkTo(door.point);
      // Doors on the same line, as the leaves of one, are legs without a length but for the last.
      const bool isLast = scene::isLastOnLine(doors, i);
      const double length = isLast ? computeLength(door.point, door.point + 1) : 0;
      const double wait = isLast && answer.doorsOpen ? door.secondsToOpen : 0;
      addLeg(v1::NavigationLeg::KIND_DOOR, door.point, length, length / speed + wait, door.body,
             message);
      if (isLast) at = door.point + 1;
    }
    walkTo(end);
  }

  void addLegs(const scene::NavigationPath& path, const std::vector<scene::DoorOnPath>& doors,
               v1::NavigationPath& message) const {
    for (std::size_t i = 0; i < path.legs.size(); ++i) {
      const scene::PathLeg& leg = path.legs[i];
      const std::size_t end =
          i + 1 < path.legs.size() ? path.legs[i + 1].first : path.points.size() - 1;
      switch (leg.kind) {
        case scene::PathLeg::Kind::walk:
          addWalk(path, leg, end, doors, message);
          break;
        case scene::PathLeg::Kind::aside:
          addLeg(v1::NavigationLeg::KIND_ASIDE, leg.first, leg.length, leg.seconds, std::nullopt,
                 message);
          break;
        case scene::PathLeg::Kind::drop:
          addLeg(v1::NavigationLeg::KIND_DROP, leg.first, leg.length, leg.seconds, std::nullopt,
                 message);
          break;
        case scene::PathLeg::Kind::lift:
          addLeg(v1::NavigationLeg::KIND_LIFT, leg.first, leg.length, leg.seconds, leg.body,
                 message);
          message.mutable_legs()->rbegin()->set_from_level(leg.fromLevel);
          message.mutable_legs()->rbegin()->set_to_level(leg.toLevel);
          break;
      }
    }
  }

  /// The first door on a path through open ones that stops an agent as it is.
  std::optional<BlockingDoor> findBlockingDoor(const Vec3& from, const Vec3& to,
                                               const scene::PathOptions& options) const {
    scene::Navigation& open = answer.withOpenDoors();
    const scene::NavigationPath through = open.findPath(from, to, options, answer.progress);
    if (!through.found()) return std::nullopt;
    const auto doors = findDoors(open, through);
    const auto first = std::ranges::find_if(doors, &scene::DoorOnPath::isInTheWay);
    if (first == doors.end()) return std::nullopt;
    const Vec3 &start = through.points[first->point], &end = through.points[first->point + 1];
    const Vec3 at = start + first->onLine * (end - start).normalized();
    const auto narrowest =
        open.findNarrowest(scene::findDoorway(answer.scene, first->body, at.y(), kHalfWall));
    return BlockingDoor{first->body, at, narrowest ? narrowest->clearWidth : 0};
  }

  /// Gives a door as the reason, if a path leads through it when it is open. Of two islands it is
  /// sought once.
  void explainByDoors(const Vec3& from, const Vec3& to, const scene::PathOptions& options,
                      v1::NavigationPath& message) const {
    if (answer.doorsOpen || !answer.withOpenDoors) return;
    const auto first = answer.navigation.findIsland(from), last = answer.navigation.findIsland(to);
    const bool isOfIslands = first && last && first != last && options == scene::PathOptions();
    const std::pair islands(first.value_or(0), last.value_or(0));
    const auto known = isOfIslands ? answer.closedDoors.find(islands) : answer.closedDoors.end();
    const auto door = known != answer.closedDoors.end() ? std::optional(known->second)
                                                        : findBlockingDoor(from, to, options);
    if (!door) return;
    if (isOfIslands) answer.closedDoors.emplace(islands, *door);
    const scene::BodySpec& spec = answer.scene.model().bodies[door->body];
    std::string state = isClosed(door->body) ? "is closed" : "is not open far enough";
    if (door->openWidth > 0)
      state += fmt::format(" (clear width when open: {:.3f} m)", door->openWidth);
    message.set_reason("the door '" + spec.name + "' " + state + ": " + answer.doorRemedy);
    message.set_obstacle(spec.objects.front() + 1);
    message.set_obstacle_name(spec.name);
    *message.mutable_obstacle_at() = toProto(door->at);
    message.set_clear_width(door->openWidth);
  }
};

}  // namespace

std::optional<Vec3> findPlaceIn(scene::Navigation& navigation,
                                const std::function<scene::Navigation&()>& withOpenDoors,
                                std::span<const scene::NamedPlace> named,
                                const std::optional<Vec3>& start) {
  const auto place = navigation.findPlaceIn(named, start);
  if (!place || !start || !withOpenDoors) return place;
  if (navigation.findIsland(*place) == navigation.findIsland(*start)) return place;
  scene::Navigation& open = withOpenDoors();
  const auto behind = open.findPlaceIn(named, start);
  return behind && open.findIsland(*behind) == open.findIsland(*start) ? behind : place;
}

void writePath(const PathAnswer& answer, const Vec3& from, const Vec3& to,
               const scene::PathOptions& options, const PathMeasures& measures,
               v1::NavigationPath& message) {
  const PathWriter writer{answer};
  scene::NavigationPath path =
      answer.kept ? answer.navigation.findPathAgain(from, to, *answer.kept, answer.progress)
                  : answer.navigation.findPath(from, to, options, answer.progress);
  std::vector<scene::DoorOnPath> doors;
  if (path.found()) doors = writer.findDoors(answer.navigation, path);
  if (path.found() && answer.doorsOpen) writer.stepAside(to, options, path, doors);
  // As they are, a path leads through none that is closed, but it may touch one.
  if (!answer.doorsOpen)
    std::erase_if(doors, [&](const auto& door) { return writer.isClosed(door.body); });
  message.set_found(path.found());
  for (const Vec3& point : path.points) *message.add_points() = toProto(point);
  message.set_length(path.length);
  message.set_reason(path.reason);
  if (path.obstruction) {
    message.set_obstacle(path.obstruction->entity);
    message.set_obstacle_name(answer.navigation.findEntityName(path.obstruction->entity));
    *message.mutable_obstacle_at() = toProto(path.obstruction->position);
    message.set_clear_width(path.obstruction->clearWidth);
  }
  if (!path.found()) return writer.explainByDoors(from, to, options, message);
  if (answer.doorsOpen) writer.addDoors(doors, message);
  writer.addLegs(path, doors, message);
  if (measures.steps)
    for (const scene::PathStep& step : answer.navigation.findSteps(path.points)) {
      v1::NavigationPath::Step& one = *message.add_steps();
      *one.mutable_at() = toProto(step.position);
      one.set_rise(step.rise);
    }
  if (!measures.narrowest) return;
  const auto narrowest = answer.navigation.findNarrowest(path.points);
  if (!narrowest) return;
  message.set_clear_width(narrowest->clearWidth);
  *message.mutable_narrowest_at() = toProto(narrowest->position);
}

}  // namespace enfilade::server
