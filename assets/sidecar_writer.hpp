// The sidecar that says how the bundled building's doors and lift move, and what else does
// (SIDECAR.md): the study's armchair can be pushed, its globe turns when it is told to.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "assets/building.hpp"

namespace enfilade::assets {

/// Bodies are named as their objects, without "building/". Doors stand open in the model; those
/// that turn are opened by whoever walks into them.
std::string sidecarText(const scene::Model& model, const std::vector<MovingPart>& movingParts);

/// Writes the sidecar of a GLB file beside it. Throws std::runtime_error with its name.
void writeSidecarOf(std::filesystem::path glb, const std::string& text);

}  // namespace enfilade::assets
