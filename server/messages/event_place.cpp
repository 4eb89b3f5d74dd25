#include "server/messages/event_place.hpp"

#include <optional>

#include "scene/world/queries/space_query.hpp"

namespace enfilade::server {
namespace {

/// Metres: points of contact lie on walls and floors, and the surface of a space next to them.
constexpr double kSpaceTolerance = 0.05;

bool hasPlace(const scene::ContactEvent& event) {
  const collision::SeparationResult& s = event.separation;
  return event.b != 0 && !(s.pointA.isZero(0) && s.pointB.isZero(0) && s.normal.isZero(0));
}

/// The storey of an object or, of a part without one, of its whole.
std::optional<std::uint32_t> findOwnStorey(const scene::Model& model, scene::EntityId entity) {
  if (entity == 0 || entity > model.objects.size()) return std::nullopt;
  const scene::Object& object = model.objects[entity - 1];
  return object.storey || !object.partOf ? object.storey : model.objects[*object.partOf].storey;
}

/// The highest storey whose floor is not above the point; the lowest one below all floors.
std::optional<std::uint32_t> findLevel(const scene::Model& model, double height) {
  std::optional<std::uint32_t> level;
  for (std::uint32_t i = 0; i < model.storeys.size(); ++i)
    if (!level || model.storeys[i].elevation <= height + kSpaceTolerance) level = i;
  return level;
}

}  // namespace

EventPlace findEventPlace(const scene::Model& model, const scene::ContactEvent& event) {
  static const std::string none;
  if ((model.storeys.empty() && model.spaces.empty()) || !hasPlace(event))
    return {none, none, none};
  const scene::Vec3& point = event.separation.pointA;
  const scene::Space* const space = scene::findSpace(model, point, kSpaceTolerance);
  std::optional<std::uint32_t> storey = space != nullptr ? space->storey : std::nullopt;
  if (!storey) storey = findOwnStorey(model, event.b);
  if (!storey) storey = findOwnStorey(model, event.a);
  if (!storey) storey = findLevel(model, point.y());
  return {storey ? model.storeys[*storey].name : none, space != nullptr ? space->name : none,
          space != nullptr ? space->longName : none};
}

}  // namespace enfilade::server
