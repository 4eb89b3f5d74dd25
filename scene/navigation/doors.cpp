#include "scene/navigation/doors.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "collision/assert.hpp"
#include "collision/motion/shape_cast.hpp"
#include "collision/shapes/box_tree.hpp"
#include "scene/navigation/walk/shape_separation.hpp"
#include "scene/world/data/body.hpp"
#include "scene/world/world.hpp"

namespace enfilade::scene {
namespace {

/// Share of a leg, 0..1, up to where an agent on it touches a body; nullopt: it does not.
std::optional<double> findTouch(const AvatarShape& agent, const Vec3& from, const Vec3& leg,
                                const BodyShape& shape, const collision::Pose& pose,
                                const WorldSettings& settings) {
  const double threshold = computeContactThreshold(settings);
  const collision::ContactOffset offset{threshold, threshold + settings.contactOffset / 32};
  const collision::Mat3 rotation = pose.rotation.toRotationMatrix();
  std::optional<double> first;
  const auto castAgainst = [&](const collision::Hull& hull) {
    const collision::PlacedConvex placed{hull.vertices, pose.translation, &rotation, &hull};
    for (const AvatarPart& part : agent.parts) {
      const collision::PlacedConvex moved = placeAvatarPart(part, from);
      collision::FeatureCache cache;
      if (collision::computeSeparationWithin(moved, placed, threshold, cache)) first = 0;
      if (first == 0) return;
      const collision::MotionResult cast = collision::castShape(moved, leg, placed, offset, cache);
      if (!cast.isClear()) first = std::min(first.value_or(1), cast.lo);
    }
  };
  const Aabb swept =
      inflate(collision::computeSweptAabb(placeBox(agent.box, from), leg), 2 * offset.rest);
  const Vec3 middle = rotation.transpose() * (swept.centre() - pose.translation);
  const Vec3 halfExtent = rotation.transpose().cwiseAbs() * (0.5 * swept.size());
  const Aabb inBodyFrame{middle - halfExtent, middle + halfExtent};
  collision::forEachOverlappingLeaf(
      shape.tree, collision::toFloatAabb(inBodyFrame, shape.tree.origin),
      [&](std::uint32_t item, std::uint32_t count) {
        for (std::uint32_t i = item; i < item + count && first != 0; ++i)
          castAgainst(shape.parts[shape.tree.order[i]]);
      });
  return first;
}

}  // namespace

bool hasDoors(const Scene& scene) {
  return std::ranges::any_of(scene.model().bodies,
                             [](const BodySpec& body) { return getTraits(body.kind).isDoor; });
}

std::shared_ptr<const Snapshot> makeSnapshotWithOpenDoors(std::shared_ptr<const Scene> scene,
                                                          const WorldSettings& settings) {
  constexpr double kMaxSeconds = 30;  // a door that takes longer stays where it is
  World world(std::move(scene), settings);
  for (const BodySpec& body : world.scene().model().bodies) {
    if (!getTraits(body.kind).isDoor) continue;
    BodyCommand command;
    command.body = body.name;
    command.action = BodyCommand::Action::open;
    submitBodyCommand(world, std::move(command));
  }
  const int maxTicks =
      hasDoors(world.scene()) ? static_cast<int>(kMaxSeconds / settings.tickDuration) : 0;
  for (int tick = 0; tick < maxTicks; ++tick) {
    tickWorld(world);
    const auto& bodies = *world.snapshot()->bodies;
    if (std::ranges::none_of(bodies, [&](const BodySnapshot& body) {
          return body.moving && getTraits(world.scene().model().bodies[body.index].kind).isDoor;
        }))
      break;
  }
  return world.snapshot();
}

Snapshot takeDoors(const Scene& scene, Snapshot present, const Snapshot& open) {
  auto bodies = std::make_shared<std::vector<BodySnapshot>>(*present.bodies);
  for (std::size_t i = 0; i < bodies->size(); ++i) {
    const BodySnapshot& opened = (*open.bodies)[i];
    ENFILADE_ASSERT(opened.index == (*bodies)[i].index);
    if (getTraits(scene.model().bodies[opened.index].kind).isDoor) (*bodies)[i] = opened;
  }
  present.bodies = std::move(bodies);
  return present;
}

namespace {

/// The snapshot with all doors closed.
Snapshot closeDoors(const Scene& scene, Snapshot snapshot) {
  auto bodies = std::make_shared<std::vector<BodySnapshot>>(*snapshot.bodies);
  for (BodySnapshot& body : *bodies) {
    const BodySpec& spec = scene.model().bodies[body.index];
    if (!getTraits(spec.kind).isDoor) continue;
    body.jointPosition = spec.closedPosition;
    body.pose = computeBodyPose(spec, computeJointPose(spec, spec.closedPosition));
  }
  snapshot.bodies = std::move(bodies);
  return snapshot;
}

}  // namespace

std::vector<DoorOnPath> findDoorsOnPath(EntityIndex& index, const WorldSettings& settings,
                                        const Snapshot& snapshot, const AvatarShape& agent,
                                        const std::vector<Vec3>& points,
                                        std::span<const PathLeg> legs) {
  std::vector<DoorOnPath> doors;
  const std::vector<BodySpec>& bodies = index.scene().model().bodies;
  if (!hasDoors(index.scene()) || points.size() < 2) return doors;
  const Snapshot closed = closeDoors(index.scene(), snapshot);
  double distance = 0;
  for (std::size_t i = 1; i < points.size(); ++i) {
    const Vec3 leg = points[i] - points[i - 1];
    Aabb box = placeBox(agent.box, points[i - 1]);
    box.include(placeBox(agent.box, points[i]));
    box = inflate(box, settings.contactOffset);
    const auto findTouchOn = [&](const Snapshot& state, std::size_t body) -> std::optional<double> {
      const BodySnapshot& door = (*state.bodies)[body];
      if (!overlaps(box, computeBodyAabb({index, state}, door))) return std::nullopt;
      return findTouch(agent, points[i - 1], leg, *index.scene().bodyShape(door.index), door.pose,
                       settings);
    };
    for (std::size_t b = 0; b < snapshot.bodies->size(); ++b) {
      const BodySnapshot& body = (*snapshot.bodies)[b];
      const BodySpec& spec = bodies[body.index];
      if (!getTraits(spec.kind).isDoor) continue;
      const auto known =
          std::ranges::find_if(doors, [&](const DoorOnPath& d) { return d.body == body.index; });
      if (known != doors.end() && known->isInTheWay) continue;
      std::optional<double> touch = findTouchOn(snapshot, b);
      const bool isInTheWay = touch.has_value();
      if (!touch && known == doors.end()) touch = findTouchOn(closed, b);
      if (!touch) continue;
      if (known != doors.end()) doors.erase(known);  // it stood further on than where it closes
      const double rest = findOpenLimit(spec) - body.jointPosition;
      const double onLeg = *touch * leg.norm();
      doors.push_back({body.index, i - 1, distance + onLeg, onLeg, computeMotionSeconds(spec, rest),
                       isInTheWay});
    }
    const auto ofLeg = std::ranges::find(doors, i - 1, &DoorOnPath::point);
    std::sort(ofLeg, doors.end(), [](const DoorOnPath& a, const DoorOnPath& b) {
      return std::pair(a.distance, a.body) < std::pair(b.distance, b.body);
    });
    // Of a fall or a ride, which are one line, the leg has the metres walked.
    const auto jump = std::ranges::find_if(legs, [&](const PathLeg& one) {
      return one.first == i - 1 &&
             (one.kind == PathLeg::Kind::drop || one.kind == PathLeg::Kind::lift);
    });
    distance += jump == legs.end() ? leg.norm() : jump->length;
  }
  return doors;
}

std::vector<Vec3> findDoorway(const Scene& scene, std::uint32_t door, double height, double reach) {
  const BodySpec& spec = scene.model().bodies[door];
  const BodyShape& shape = *scene.bodyShape(door);
  const collision::Pose closed = computeBodyPose(spec, computeJointPose(spec, spec.closedPosition));
  std::vector<Vec3> corners;
  for (const collision::Hull& part : shape.parts)
    for (const Vec3& vertex : part.vertices) {
      corners.push_back(closed.rotation * vertex + closed.translation);
      corners.back().y() = height;
    }
  // The two that are farthest apart are at both ends of the leaf.
  std::pair<Vec3, Vec3> ends(corners.front(), corners.front());
  for (const Vec3& corner : corners)
    if ((corner - ends.first).norm() > (ends.second - ends.first).norm()) ends.second = corner;
  for (const Vec3& corner : corners)
    if ((corner - ends.second).norm() > (ends.second - ends.first).norm()) ends.first = corner;
  const Vec3 middle = 0.5 * (ends.first + ends.second);
  const Vec3 through = (ends.second - ends.first).cross(Vec3::UnitY()).normalized();
  return {middle - reach * through, middle + reach * through};
}

DoorSwing::DoorSwing(EntityIndex& index, const WorldSettings& settings, const Snapshot& snapshot,
                     const NavigationAgent& agent, std::uint32_t body)
    : index_(index),
      spec_(index.scene().model().bodies[body]),
      bodies_(std::make_shared<std::vector<BodySnapshot>>(*snapshot.bodies)),
      prism_(makePrismShape(agent.radius, agent.height, agent.height, settings)),
      door_((*bodies_)[body]),
      from_(door_.jointPosition),
      to_(findOpenLimit(spec_)),
      distance_(computeDisplacementBound(*index.scene().bodyShape(body),
                                         computeJointPose(spec_, from_),
                                         computeJointPose(spec_, to_))) {
  ENFILADE_ASSERT(door_.index == body);
  moved_.bodies = bodies_;
}

double DoorSwing::measureDistance(const Vec3& footPosition, double jointPosition) {
  door_.jointPosition = jointPosition;
  door_.pose = computeBodyPose(spec_, computeJointPose(spec_, jointPosition));
  const auto separation =
      computeSeparationFromShape(index_, moved_, prism_, footPosition, door_.id);
  return separation ? separation->distance : 0;
}

/// Conservative advancement: the door opens by as much as it can without coming to the agent.
bool DoorSwing::touches(const Vec3& footPosition) {
  constexpr double kRoom = 0.01;     // metres
  constexpr int kMaxSteps = 10'000;  // a step opens the door by 5 mm or more
  double share = 0;
  for (int step = 0; step < kMaxSteps; ++step) {
    const double distance = measureDistance(footPosition, from_ + share * (to_ - from_));
    if (distance <= kRoom) return true;
    if (share >= 1 || !(distance_ > 0)) return false;
    share = std::min(1.0, share + (distance - 0.5 * kRoom) / distance_);
  }
  return true;
}

bool isLastOnLine(const std::vector<DoorOnPath>& doors, std::size_t index) {
  return index + 1 == doors.size() || doors[index + 1].point != doors[index].point;
}

}  // namespace enfilade::scene
