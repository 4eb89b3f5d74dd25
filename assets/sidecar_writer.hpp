// The sidecar that says how the bundled building's doors and lift move (SIDECAR.md).
#pragma once

#include <string>
#include <vector>

#include "assets/building.hpp"

namespace enfilade::assets {

/// Bodies are named as their objects, without "building/". Doors stand open in the model; those
/// that turn are opened by whoever walks into them.
std::string sidecarText(const scene::Model& model, const std::vector<MovingPart>& movingParts);

}  // namespace enfilade::assets
