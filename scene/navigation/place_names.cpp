#include "scene/navigation/place_names.hpp"

#include <algorithm>
#include <limits>
#include <optional>
#include <string_view>

#include "scene/model/object_box.hpp"
#include "scene/model/shapes/space_solid.hpp"

namespace enfilade::scene {
namespace {

constexpr double kStoreyDepth = 0.3, kStoreyHeight = 2;  // metres below and above its floor

NamedPlace makePlace(const Aabb& box) {
  return {.box = box, .middle = box.centre()};
}

using NamedPlaces = std::vector<NamedPlace>;

NamedPlaces findRooms(const Model& model, std::string_view name) {
  NamedPlaces rooms;
  for (const Space& space : model.spaces) {
    if (space.name != name && space.longName != name && space.globalId != name) continue;
    if (space.box.empty()) continue;
    const Vec3 middle = findSpaceMiddle(space, space.box).point;
    // An open surface has no inside: the box alone says where the room is.
    const bool solid = !space.surface.empty() && isInSpace(space, middle);
    rooms.push_back({.box = space.box, .middle = middle, .space = solid ? &space : nullptr});
  }
  return rooms;
}

NamedPlaces findStoreys(const Scene& scene, std::string_view name) {
  NamedPlaces storeys;
  for (const Storey& storey : scene.model().storeys) {
    if (storey.name != name && storey.globalId != name) continue;
    Aabb box = scene.bounds();
    box.min.y() = storey.elevation - kStoreyDepth;
    box.max.y() = storey.elevation + kStoreyHeight;
    storeys.push_back(makePlace(box));
  }
  return storeys;
}

std::uint32_t findBodyOfObject(const Model& model, std::uint32_t object) {
  for (std::uint32_t body = 0; body < model.bodies.size(); ++body)
    if (std::ranges::count(model.bodies[body].objects, object) > 0) return body;
  return kNoBody;
}

/// Adds the place around an object or a body, unless its extent is unknown.
void addPlaceAround(const Aabb& box, std::uint32_t body, double reach, NamedPlaces& places) {
  if (box.empty()) return;
  NamedPlace place = makePlace(inflateAround(box, reach));
  place.body = body;
  place.reach = reach;
  places.push_back(place);
}

NamedPlaces findObjects(const Model& model, std::string_view name, double reach) {
  NamedPlaces objects;
  for (std::uint32_t i = 0; i < model.objects.size(); ++i) {
    const Object& object = model.objects[i];
    if (object.path != name && (object.globalId != name || name.empty())) continue;
    addPlaceAround(computeWorldAabb(model, object), findBodyOfObject(model, i), reach, objects);
  }
  return objects;
}

NamedPlaces findNamedBodies(const Model& model, std::string_view name, double reach) {
  NamedPlaces bodies;
  for (std::uint32_t i = 0; i < model.bodies.size(); ++i) {
    const BodySpec& body = model.bodies[i];
    if (body.name != name) continue;
    Aabb box;
    for (const std::uint32_t object : body.objects)
      box.include(computeWorldAabb(model, model.objects[object]));
    addPlaceAround(box, i, reach, bodies);
  }
  return bodies;
}

}  // namespace

Aabb inflateAround(const Aabb& object, double reach) {
  Aabb box = object;
  box.min -= Vec3(reach, kStoreyHeight, reach);
  box.max += Vec3(reach, 0, reach);
  return box;
}

std::vector<Vec3> listAims(const NamedPlace& named, const Vec3& middle) {
  constexpr int kLines = 8;
  std::vector<Vec3> aims{middle};
  if (named.space == nullptr) return aims;
  const Vec3 step = named.box.size() / kLines;
  for (int i = 0; i < kLines * kLines; ++i) {
    const double x = named.box.min.x() + (i % kLines + 0.5) * step.x();
    const double z = named.box.min.z() + (i / kLines + 0.5) * step.z();
    if (isInSpace(*named.space, {x, named.middle.y(), z})) aims.emplace_back(x, middle.y(), z);
  }
  return aims;
}

std::vector<NamedPlace> findNamedPlaces(const Scene& scene, const std::string& name, double reach) {
  const Model& model = scene.model();
  const auto after = [&](std::string_view prefix) -> std::optional<std::string_view> {
    if (!name.starts_with(prefix)) return std::nullopt;
    return std::string_view(name).substr(prefix.size());
  };
  if (const auto room = after("room:")) return findRooms(model, *room);
  if (const auto storey = after("storey:")) return findStoreys(scene, *storey);
  if (const auto object = after("object:")) return findObjects(model, *object, reach);
  if (const auto body = after("body:")) return findNamedBodies(model, *body, reach);
  if (NamedPlaces rooms = findRooms(model, name); !rooms.empty()) return rooms;
  if (NamedPlaces storeys = findStoreys(scene, name); !storeys.empty()) return storeys;
  if (NamedPlaces objects = findObjects(model, name, reach); !objects.empty()) return objects;
  return findNamedBodies(model, name, reach);
}

}  // namespace enfilade::scene
