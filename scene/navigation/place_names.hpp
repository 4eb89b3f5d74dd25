// Places by name: rooms, storeys and objects of a model as goals of navigation.
#pragma once

#include <optional>
#include <string>

#include "scene/world/data/scene.hpp"

namespace enfilade::scene {

/// Where to look for a place, scene frame, metres: inside a room or a storey, next to an object.
/// `name`: a space's name, long name or GlobalId, a storey's, then an object's path or GlobalId,
/// with the prefix "room:", "storey:" or "object:" only one of these. `reach`: how far from an
/// object. nullopt: the name is unknown, or its extent is.
std::optional<Aabb> findNamedPlace(const Scene& scene, const std::string& name, double reach);

}  // namespace enfilade::scene
