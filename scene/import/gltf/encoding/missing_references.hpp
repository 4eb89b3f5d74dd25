// Finds and removes dangling references in a glTF file: indices of missing nodes, meshes, cameras
// or skins. Private to the import.
#pragma once

#include <nlohmann/json.hpp>
#include <vector>

#include "scene/import/gltf/encoding/gltf_nodes.hpp"
#include "scene/model/model.hpp"

namespace enfilade::scene {

/// Whether the scene refers to nodes, or one of its nodes to a mesh or camera, that is missing.
/// `sections`: those of the file without its nodes.
bool hasMissingReferences(const GltfNodeTree& tree, const nlohmann::json& sections);

/// Removes indices of meshes, cameras, skins, children and root nodes that do not exist, and
/// reports each with its node or scene.
void dropMissingReferences(nlohmann::json& gltf, std::vector<Diagnostic>& problems);

}  // namespace enfilade::scene
