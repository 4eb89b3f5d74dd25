// Writes the sidecar (SIDECAR.md) that describes the moving bodies of the bundled building: doors,
// lift, the study's movable armchair and its driven globe.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "assets/moving_part.hpp"
#include "scene/model/model.hpp"

namespace enfilade::assets {

/// Bodies are named as their objects, without "building/". Doors are open in the model; avatars
/// push rotating doors open by walking into them.
std::string makeSidecarText(const scene::Model& model, const std::vector<MovingPart>& movingParts);

/// Writes the sidecar next to the GLB file. Throws std::runtime_error with the sidecar's name.
void writeSidecar(std::filesystem::path glb, const std::string& text);

}  // namespace enfilade::assets
