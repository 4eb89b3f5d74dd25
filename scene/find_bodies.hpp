// What moves in a model, from all that can say so. All else is still.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "scene/model.hpp"

namespace enfilade::scene {

/// How many bodies each source gave, and what was left still although something about it looked
/// like a body, with the reason.
struct BodyFindings {
  std::size_t sidecar = 0, suffix = 0, ifc = 0;
  std::vector<std::string> leftStill;
};

/// Appends the bodies to the model: of the sidecar beside `file`, then, for what that leaves open,
/// what the model says itself. Throws SidecarError.
BodyFindings findBodies(Model& model, const std::filesystem::path& file);

}  // namespace enfilade::scene
