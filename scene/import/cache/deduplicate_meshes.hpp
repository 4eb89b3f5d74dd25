// Meshes that a file repeats are stored once.
#pragma once

#include "scene/model/model.hpp"

namespace enfilade::scene {

/// Objects of meshes that are equal to the last bit (names apart) come to use the first of them;
/// the others go, and so do meshes that no object uses. Returns how many went.
std::size_t shareEqualMeshes(Model& model);

}  // namespace enfilade::scene
