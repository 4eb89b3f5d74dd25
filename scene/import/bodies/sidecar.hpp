// Sidecar of a model: the hand-written file `<scene>.walk.json` that describes its bodies
// (SIDECAR.md).
#pragma once

#include <cstdint>
#include <filesystem>
#include <set>
#include <string>
#include <string_view>

#include "scene/import/bodies/sidecar_error.hpp"
#include "scene/model/model.hpp"

namespace enfilade::scene {

/// Returns the sidecar's path: hall.walk.json for hall.glb, in the same folder.
std::filesystem::path makeSidecarPath(const std::filesystem::path& model);

/// The content of a sidecar other than its bodies.
struct Sidecar {
  std::set<std::uint32_t> staticObjects;  ///< objects that are static whatever other sources say
};

/// Appends the sidecar's bodies to the model, and an object for each trigger with a box. `source`
/// names the text in errors. Throws SidecarError and then leaves the model unchanged.
Sidecar applySidecar(Model& model, std::string_view text, const std::string& source);

}  // namespace enfilade::scene
