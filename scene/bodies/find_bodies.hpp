// What moves in a model, as its sidecar says. All else is still.
#pragma once

#include <filesystem>

#include "scene/model.hpp"

namespace enfilade::scene {

/// Appends the bodies to the model: of the sidecar beside `file`, if there is one. Throws
/// SidecarError.
void findBodies(Model& model, const std::filesystem::path& file);

}  // namespace enfilade::scene
