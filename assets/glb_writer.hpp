// Writes a model as binary glTF 2.0. Nodes are nested by the segments of the objects' paths; meshes
// are stored once and shared by nodes. The same model gives the same bytes.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "assets/moving_part.hpp"
#include "scene/model/model.hpp"

namespace enfilade::assets {

/// Returns the bytes of the GLB file. Moving parts become extras of their nodes
/// (scene/import/bodies/SIDECAR.md): rotating and sliding doors, in the node's own frame and
/// relative to its pose. A sidecar next to the file has further data. Textures and texture
/// coordinates are not written. Throws std::length_error beyond GLB's 4 GiB, and
/// std::invalid_argument naming an object that cannot be written.
std::string encodeGlb(const scene::Model& model, const std::vector<MovingPart>& movingParts = {});

/// Throws std::runtime_error naming the file.
void writeGlb(const std::filesystem::path& file, const scene::Model& model,
              const std::vector<MovingPart>& movingParts = {});

}  // namespace enfilade::assets
