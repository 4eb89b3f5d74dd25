// Expands EXT_mesh_gpu_instancing: each instance becomes a node. Private to the import.
#pragma once

#include <nlohmann/json.hpp>
#include <vector>

#include "scene/import/gltf/gltf_buffers.hpp"
#include "scene/model/model.hpp"

namespace enfilade::scene {

/// Replaces the mesh of each instanced node by child nodes NAME[0], NAME[1], ..., appended to the
/// file's nodes. Indices of existing nodes stay. Attributes of instances that do not place them
/// become extras of their nodes. Adds findings to `problems`. Throws ImportError.
void expandInstances(nlohmann::json& gltf, GltfBuffers& buffers, std::vector<Diagnostic>& problems);

}  // namespace enfilade::scene
