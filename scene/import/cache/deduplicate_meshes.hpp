// Removes duplicate meshes of a model.
#pragma once

#include "scene/model/model.hpp"

namespace enfilade::scene {

/// Lets objects with bitwise equal meshes (names apart) share the first of them. Removes the others
/// and unused meshes. Returns the number removed.
std::size_t deduplicateMeshes(Model& model);

}  // namespace enfilade::scene
