// Checks the tree of a glTF file's nodes. glTF allows each node one parent, but a node that is
// listed several times is read, and copied with all below it to each place. So a few kilobytes of
// JSON can mean more nodes than fit into memory. Private to the import.
#pragma once

#include <cstddef>
#include <filesystem>
#include <vector>

#include "scene/import/gltf/encoding/gltf_nodes.hpp"

namespace enfilade::scene {

/// Throws ImportError for nodes of the scene that are no objects, are nested deeper than
/// kMaxNodeDepth or stand below themselves, and for too many copies.
void validateNodeGraph(const GltfNodeTree& tree, const std::vector<std::size_t>& trianglesByMesh,
                       const std::filesystem::path& file);

}  // namespace enfilade::scene
