#include "server/floors/floor_plan.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <numbers>
#include <utility>

#include "server/floors/floor_plan_section.hpp"

namespace enfilade::server {
namespace {

constexpr double kCutWallBottom = 0.5, kCutWallTop = 2.0;  // metres above a floor that a wall spans
constexpr double kMaxStoreyDistance = 0.6;  // metres between a walked floor and a storey's
constexpr double kWholeTurn = 2 * std::numbers::pi;
constexpr double kArcStep = 0.05;  // radians between two points of an arc

void addStatic(const scene::Scene& scene, FloorPlan& plan) {
  std::vector<PlanShape> walls;
  for (ObjectSection& section : cutStatic(scene, plan.floor + kPlanCutHeight)) {
    const bool isWall = section.box.min.y() <= plan.floor + kCutWallBottom &&
                        section.box.max.y() >= plan.floor + kCutWallTop;
    (isWall ? walls : plan.shapes)
        .push_back({isWall ? PlanShape::Kind::wall : PlanShape::Kind::furniture, section.object + 1,
                    std::move(section.loops), std::move(section.lines)});
  }
  // Walls come last: their edges stay sharp.
  std::ranges::move(walls, std::back_inserter(plan.shapes));
}

// ---- bodies -------------------------------------------------------------------------------------

/// The section of a body's objects in their initial pose.
PlanShape cutBody(const scene::Scene& scene, const scene::BodySpec& body, double height) {
  PlanShape whole;
  whole.kind = getTraits(body.kind).isDoor ? PlanShape::Kind::door : PlanShape::Kind::body;
  whole.entity = body.objects.front() + 1;
  for (const std::uint32_t object : body.objects) {
    ObjectSection part = cutObject(scene.model(), object, height);
    std::ranges::move(part.loops, std::back_inserter(whole.loops));
    std::ranges::move(part.lines, std::back_inserter(whole.lines));
  }
  return whole;
}

/// The point of a door's leaf that is farthest from its hinge.
Vec3 findLeafEnd(const PlanShape& leaf, const Vec3& hinge) {
  Vec3 end = hinge;
  double longest = 0;
  for (const auto* lines : {&leaf.loops, &leaf.lines}) {
    for (const auto& line : *lines) {
      for (const Vec3& point : line) {
        const double distance = std::hypot(point.x() - hinge.x(), point.z() - hinge.z());
        if (distance > longest) longest = distance, end = point;
      }
    }
  }
  return end;
}

/// Arcs to the limits of the leaf, and the leaf at each.
void addSwing(const scene::BodySpec& door, const PlanShape& leaf, FloorPlan& plan) {
  const Vec3 end = findLeafEnd(leaf, door.anchor);
  const Vec3 hinge(door.anchor.x(), end.y(), door.anchor.z());
  const double radius = (end - hinge).norm();
  const double closed = std::atan2(end.z() - hinge.z(), end.x() - hinge.x());
  // A positive turn about +y leads from +z to +x.
  const double sign = door.axis.y() > 0 ? -1 : 1;
  for (const double limit : {door.low, door.high}) {
    if (limit == 0) continue;
    const auto at = [&](double turn) -> Vec3 {
      const double angle = closed + sign * turn;
      return hinge + radius * Vec3(std::cos(angle), 0, std::sin(angle));
    };
    const double shown = std::clamp(limit, -kWholeTurn, kWholeTurn);  // a sidecar may state more
    const int steps = std::max(1, static_cast<int>(std::ceil(std::abs(shown) / kArcStep)));
    std::vector<Vec3> arc;
    for (int i = 0; i <= steps; ++i) arc.push_back(at(shown * i / steps));
    const std::vector<Vec3> open{hinge, at(limit)};
    plan.shapes.push_back({PlanShape::Kind::swing, leaf.entity, {}, {std::move(arc)}});
    plan.shapes.push_back({PlanShape::Kind::openDoor, leaf.entity, {}, {open}});
  }
}

/// The leaf where it is open.
void addSlide(const scene::BodySpec& door, PlanShape leaf, FloorPlan& plan) {
  const double limit = std::abs(door.low) > std::abs(door.high) ? door.low : door.high;
  leaf.kind = PlanShape::Kind::swing;
  leaf.lines.clear();
  for (std::vector<Vec3>& loop : leaf.loops)
    for (Vec3& point : loop) point += limit * door.axis;
  plan.shapes.push_back(std::move(leaf));
}

/// The outline of a lift on this floor, with its diagonals.
void addLift(const scene::Scene& scene, const scene::BodySpec& lift, FloorPlan& plan) {
  scene::Aabb box;
  for (const std::uint32_t object : lift.objects)
    box.include(cutObject(scene.model(), object, plan.floor).box);
  if (box.empty()) return;
  const double y = plan.floor + kPlanCutHeight;
  const auto at = [&](const Vec3& x, const Vec3& z) { return Vec3(x.x(), y, z.z()); };
  const std::array corners{at(box.min, box.min), at(box.max, box.min), at(box.max, box.max),
                           at(box.min, box.max)};
  plan.shapes.push_back({PlanShape::Kind::lift,
                         lift.objects.front() + 1,
                         {{corners.begin(), corners.end()}},
                         {{corners[0], corners[2]}, {corners[1], corners[3]}}});
}

void addBody(const scene::Scene& scene, const scene::BodySpec& body, FloorPlan& plan) {
  using enum scene::BodyKind;
  const auto cut = [&] { return cutBody(scene, body, plan.floor + kPlanCutHeight); };
  const auto add = [&](const PlanShape& shape) {
    const bool isCut = !shape.loops.empty() || !shape.lines.empty();
    if (isCut) plan.shapes.push_back(shape);
    return isCut;
  };
  switch (body.kind) {
    case hinged:
      if (const PlanShape leaf = cut(); add(leaf) && std::abs(body.axis.y()) > 0.9)
        addSwing(body, leaf, plan);
      return;
    case sliding:
      if (const PlanShape leaf = cut(); add(leaf)) addSlide(body, leaf, plan);
      return;
    case lift:
      return addLift(scene, body, plan);
    case path:
    case rigid:
      add(cut());
      return;
    case trigger:  // not drawn
      return;
  }
}

}  // namespace

FloorPlan computeFloorPlan(const scene::Scene& scene, const StoreyFloor& storey) {
  const scene::Model& model = scene.model();
  FloorPlan plan;
  plan.floor = storey.height;
  plan.storey = storey.name;
  plan.north = model.north;
  addStatic(scene, plan);
  for (const scene::BodySpec& body : model.bodies) addBody(scene, body, plan);
  if (storey.storey)
    std::ranges::copy_if(model.spaces, std::back_inserter(plan.rooms),
                         [&](const scene::Space& space) { return space.storey == storey.storey; });
  return plan;
}

StoreyFloor findStoreyAt(const std::vector<StoreyFloor>& storeys, double floor) {
  const auto computeDistance = [&](const StoreyFloor& s) { return std::abs(s.height - floor); };
  const auto nearest = std::ranges::min_element(storeys, {}, computeDistance);
  StoreyFloor found;
  if (nearest != storeys.end() && computeDistance(*nearest) < kMaxStoreyDistance) found = *nearest;
  found.height = floor;
  return found;
}

FloorPlanSource makeFloorPlanSource(std::shared_ptr<const scene::Scene> scene) {
  return [scene = std::move(scene),
          storeys = std::optional<std::vector<StoreyFloor>>()](double floor) mutable {
    if (!storeys) storeys = findStoreys(*scene);  // takes a second in a large scene
    return computeFloorPlan(*scene, findStoreyAt(*storeys, floor));
  };
}

}  // namespace enfilade::server
