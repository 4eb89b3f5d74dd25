// Precedence of sources that describe the same object.
#pragma once

#include <set>
#include <vector>

#include "scene/model/model.hpp"

namespace enfilade::scene {

/// Merges the bodies of a lower-priority source into the model. A body that shares an object with
/// an existing one is dropped and counted as `replaced_bodies`. Objects in `staticObjects` are
/// removed from their bodies, and empty bodies are dropped. Duplicate names get "#2", ... The given
/// bodies must not share objects.
void mergeLowerPriorityBodies(Model& model, std::vector<BodySpec> bodies,
                              const std::set<std::uint32_t>& staticObjects);

/// Adds collision shapes to the bodies of the objects that they belong to, unless they are in a
/// body already.
void attachCollisionShapes(Model& model);

}  // namespace enfilade::scene
