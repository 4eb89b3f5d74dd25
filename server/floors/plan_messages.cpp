#include "server/floors/plan_messages.hpp"

#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "collision/assert.hpp"
#include "server/messages/world_messages.hpp"

namespace enfilade::server {
namespace {

void addPoint(const Vec3& point, v1::FloorPlan::Line& line) {
  line.add_points(point.x());
  line.add_points(point.z());
}

using Lines = std::vector<std::vector<Vec3>>;
using LineMessages = google::protobuf::RepeatedPtrField<v1::FloorPlan::Line>;

void addLines(const Lines& lines, LineMessages& into) {
  for (const auto& line : lines) {
    v1::FloorPlan::Line& message = *into.Add();
    for (const Vec3& point : line) addPoint(point, message);
  }
}

/// Lines without points are left out: an outline has a first point.
Lines linesFromProto(const LineMessages& messages, double height) {
  Lines lines;
  for (const v1::FloorPlan::Line& message : messages) {
    std::vector<Vec3> line;
    for (int i = 0; i + 1 < message.points_size(); i += 2)
      line.emplace_back(message.points(i), height, message.points(i + 1));
    if (!line.empty()) lines.push_back(std::move(line));
  }
  return lines;
}

v1::FloorPlan::Shape::Kind shapeKindToProto(PlanShape::Kind kind) {
  switch (kind) {
    case PlanShape::Kind::furniture:
      return v1::FloorPlan::Shape::KIND_FURNITURE;
    case PlanShape::Kind::wall:
      return v1::FloorPlan::Shape::KIND_WALL;
    case PlanShape::Kind::body:
      return v1::FloorPlan::Shape::KIND_BODY;
    case PlanShape::Kind::door:
      return v1::FloorPlan::Shape::KIND_DOOR;
    case PlanShape::Kind::openDoor:
      return v1::FloorPlan::Shape::KIND_OPEN_DOOR;
    case PlanShape::Kind::swing:
      return v1::FloorPlan::Shape::KIND_SWING;
    case PlanShape::Kind::lift:
      return v1::FloorPlan::Shape::KIND_LIFT;
  }
  return v1::FloorPlan::Shape::KIND_UNSPECIFIED;
}

/// A kind that a newer server may send is drawn as furniture.
PlanShape::Kind shapeKindFromProto(v1::FloorPlan::Shape::Kind kind) {
  switch (kind) {
    case v1::FloorPlan::Shape::KIND_WALL:
      return PlanShape::Kind::wall;
    case v1::FloorPlan::Shape::KIND_BODY:
      return PlanShape::Kind::body;
    case v1::FloorPlan::Shape::KIND_DOOR:
      return PlanShape::Kind::door;
    case v1::FloorPlan::Shape::KIND_OPEN_DOOR:
      return PlanShape::Kind::openDoor;
    case v1::FloorPlan::Shape::KIND_SWING:
      return PlanShape::Kind::swing;
    case v1::FloorPlan::Shape::KIND_LIFT:
      return PlanShape::Kind::lift;
    default:
      return PlanShape::Kind::furniture;
  }
}

void setRoom(const scene::Space& space, v1::FloorPlan::Room& room) {
  room.set_name(space.name);
  room.set_long_name(space.longName);
  room.set_global_id(space.globalId);
  *room.mutable_min() = toProto(space.box.min);
  *room.mutable_max() = toProto(space.box.max);
  for (const Vec3& corner : space.surface)
    for (int k = 0; k < 3; ++k) room.add_surface(corner[k]);
}

scene::Space roomFromProto(const v1::FloorPlan::Room& room) {
  scene::Space space;
  space.name = room.name();
  space.longName = room.long_name();
  space.globalId = room.global_id();
  space.box = {vectorFromProto(room.min()), vectorFromProto(room.max())};
  for (int i = 0; i + 8 < room.surface_size(); i += 9)
    for (int k = 0; k < 9; k += 3)
      space.surface.emplace_back(room.surface(i + k), room.surface(i + k + 1),
                                 room.surface(i + k + 2));
  return space;
}

}  // namespace

v1::FloorPlan toProto(const FloorPlan& plan) {
  v1::FloorPlan message;
  message.set_floor(plan.floor);
  message.set_storey(plan.storey);
  for (const PlanShape& shape : plan.shapes) {
    v1::FloorPlan::Shape& into = *message.add_shapes();
    into.set_kind(shapeKindToProto(shape.kind));
    into.set_entity(shape.entity);
    addLines(shape.loops, *into.mutable_loops());
    addLines(shape.lines, *into.mutable_lines());
  }
  for (const scene::Space& space : plan.rooms)
    if (!space.box.empty()) setRoom(space, *message.add_rooms());
  if (plan.north) addPoint({plan.north->x(), 0, plan.north->y()}, *message.mutable_north());
  return message;
}

FloorPlan floorPlanFromProto(const v1::FloorPlan& message) {
  FloorPlan plan;
  plan.floor = message.floor();
  plan.storey = message.storey();
  const double height = plan.floor + kPlanCutHeight;
  for (const v1::FloorPlan::Shape& shape : message.shapes())
    plan.shapes.push_back({shapeKindFromProto(shape.kind()), shape.entity(),
                           linesFromProto(shape.loops(), height),
                           linesFromProto(shape.lines(), height)});
  for (const v1::FloorPlan::Room& room : message.rooms()) plan.rooms.push_back(roomFromProto(room));
  if (message.north().points_size() == 2)
    plan.north = Eigen::Vector2d(message.north().points(0), message.north().points(1));
  return plan;
}

std::variant<v1::FloorPlan, v1::Error> answerFloorPlan(const v1::FloorPlanRequest& request,
                                                       const FloorPlanSource& source,
                                                       const ServerLimits& limits) {
  constexpr double kMaxCoordinate = 1e7;  // metres
  if (!(std::abs(request.floor()) <= kMaxCoordinate))
    return makeError(v1::ERROR_BAD_MESSAGE, "give a height of at most 1e7 m", "floor_plan.floor");
  const std::optional<FloorPlan> found = source(request.floor());
  ENFILADE_ASSERT(found);
  v1::FloorPlan plan = toProto(*found);
  if (const std::size_t bytes = plan.ByteSizeLong(); bytes > limits.replyBytes)
    return makeError(v1::ERROR_TOO_LARGE,
                     "the plan has " + std::to_string(bytes) + " bytes, and a reply at most " +
                         std::to_string(limits.replyBytes) +
                         ": draw it with enfilade inspect --plan where the model is",
                     "floor_plan.floor");
  return plan;
}

}  // namespace enfilade::server
