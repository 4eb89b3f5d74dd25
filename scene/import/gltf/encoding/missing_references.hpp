// Removes references of nodes and scenes to things that a glTF file lacks. assimp refuses the whole
// file for one of them. Private to the import.
#pragma once

#include <nlohmann/json.hpp>
#include <vector>

#include "scene/model/model.hpp"

namespace enfilade::scene {

/// Removes indices of meshes, cameras, skins, children and root nodes that do not exist, and
/// reports each with its node or scene.
void dropMissingReferences(nlohmann::json& gltf, std::vector<Diagnostic>& problems);

/// Removes the lights of KHR_lights_punctual, broken or not: no light of a file is drawn.
void dropAllLights(nlohmann::json& gltf);

}  // namespace enfilade::scene
