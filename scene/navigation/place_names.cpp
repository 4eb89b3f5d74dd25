#include "scene/navigation/place_names.hpp"

#include <algorithm>
#include <limits>
#include <string_view>

#include "scene/model/shapes/space_solid.hpp"

namespace enfilade::scene {
namespace {

constexpr double kStoreyDepth = 0.3, kStoreyHeight = 2;  // metres below and above its floor

NamedPlace makePlace(const Aabb& box) {
  return {box, box.centre(), nullptr};
}

std::optional<NamedPlace> findRoom(const Model& model, std::string_view name) {
  for (const Space& space : model.spaces) {
    if (space.name != name && space.longName != name && space.globalId != name) continue;
    if (space.box.empty()) continue;
    const Vec3 middle = findSpaceMiddle(space, space.box).point;
    // An open surface has no inside: the box alone says where the room is.
    const bool solid = !space.surface.empty() && isInSpace(space, middle);
    return NamedPlace{space.box, middle, solid ? &space : nullptr};
  }
  return std::nullopt;
}

std::optional<NamedPlace> findStorey(const Scene& scene, std::string_view name) {
  for (const Storey& storey : scene.model().storeys) {
    if (storey.name != name && storey.globalId != name) continue;
    Aabb box = scene.bounds();
    box.min.y() = storey.elevation - kStoreyDepth;
    box.max.y() = storey.elevation + kStoreyHeight;
    return makePlace(box);
  }
  return std::nullopt;
}

std::optional<NamedPlace> findObject(const Model& model, std::string_view name, double reach) {
  for (const Object& object : model.objects) {
    if (object.path != name && (object.globalId != name || name.empty())) continue;
    Aabb box;
    for (const std::uint32_t mesh : object.meshes)
      for (std::uint32_t i = 0; i < model.meshes[mesh].positions.size(); ++i)
        box.include(computeWorldPosition(object, model.meshes[mesh], i));
    if (box.empty()) return std::nullopt;
    box.min -= Vec3(reach, kStoreyHeight, reach);
    box.max += Vec3(reach, 0, reach);
    return makePlace(box);
  }
  return std::nullopt;
}

}  // namespace

std::optional<NamedPlace> findNamedPlace(const Scene& scene, const std::string& name,
                                         double reach) {
  const auto after = [&](std::string_view prefix) -> std::optional<std::string_view> {
    if (!name.starts_with(prefix)) return std::nullopt;
    return std::string_view(name).substr(prefix.size());
  };
  if (const auto room = after("room:")) return findRoom(scene.model(), *room);
  if (const auto storey = after("storey:")) return findStorey(scene, *storey);
  if (const auto object = after("object:")) return findObject(scene.model(), *object, reach);
  if (const auto room = findRoom(scene.model(), name)) return room;
  if (const auto storey = findStorey(scene, name)) return storey;
  return findObject(scene.model(), name, reach);
}

}  // namespace enfilade::scene
