// Places by name: rooms, storeys and objects of a model as goals of navigation.
#pragma once

#include <optional>
#include <string>

#include "scene/world/data/scene.hpp"

namespace enfilade::scene {

/// The region in which to look for a place, scene frame, metres.
struct NamedPlace {
  Aabb box;                      ///< of a room or a storey, or around an object
  Vec3 middle = Vec3::Zero();    ///< the place closest to it is wanted, horizontally
  const Space* space = nullptr;  ///< the room whose solid, at the middle's height, is above it
};

/// `name`: a space's name, long name or GlobalId, a storey's, then an object's path or GlobalId,
/// with the prefix "room:", "storey:" or "object:" only one of these. `reach`: how far from an
/// object. nullopt: the name is unknown, or its extent is.
std::optional<NamedPlace> findNamedPlace(const Scene& scene, const std::string& name, double reach);

}  // namespace enfilade::scene
