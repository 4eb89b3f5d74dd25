// Bodies of a glTF file: those of its physics extension first, then those in extras of nodes. The
// extras are `walk_kind` and the other keys of SIDECAR.md with the prefix `walk_`.
#pragma once

#include <cstdint>
#include <filesystem>
#include <set>

#include "scene/import/gltf/encoding/gltf_nodes.hpp"
#include "scene/model/model.hpp"

namespace enfilade::scene {

/// Whether the JSON may declare bodies or classes. Without, addGltfBodies() adds nothing.
bool mayHaveGltfBodies(const std::string& text);

/// Adds the bodies, collision shapes and classes that the JSON of a glTF file declares for its
/// nodes; `file` is for errors. Returns the objects that it declares static. Throws ImportError.
std::set<std::uint32_t> addGltfBodies(const std::filesystem::path& file, const std::string& text,
                                      const NodeTransforms& transforms, Model& model);

}  // namespace enfilade::scene
