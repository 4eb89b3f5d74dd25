// NamedPlace: a room, storey, object or body of a model as a goal of navigation, found by name.
#pragma once

#include <string>
#include <vector>

#include "scene/world/data/body.hpp"
#include "scene/world/data/scene.hpp"

namespace enfilade::scene {

/// The region in which to look for a place, scene frame, metres.
struct NamedPlace {
  Aabb box;                      ///< of a room or a storey, or around an object
  Vec3 middle = Vec3::Zero();    ///< the place closest to it is wanted, horizontally
  const Space* space = nullptr;  ///< the room whose solid, at the middle's height, is above it
  std::uint32_t body = kNoBody;  ///< of an object: the box moves with it
  double reach = 0;              ///< metres from the body
};

/// The box of places next to an object: `reach` metres to the sides, and on floors below.
Aabb inflateAround(const Aabb& object, double reach);

/// Points whose closest places to stand may be in the named place. These are its middle on the
/// floor, and for a room that may not fill its box the points of a grid in it.
std::vector<Vec3> listAims(const NamedPlace& named, const Vec3& middle);

/// `name`: a space's name, long name or GlobalId, a storey's, then an object's path or GlobalId,
/// or a body's name. With the prefix "room:", "storey:", "object:" or "body:" only one of these.
/// Several rooms, storeys, objects or bodies may have one name: all of the first kind that has it,
/// in the model's order. `reach`: how far from an object or a body. Empty: the name is unknown, or
/// its extent is.
std::vector<NamedPlace> findNamedPlaces(const Scene& scene, const std::string& name, double reach);

}  // namespace enfilade::scene
