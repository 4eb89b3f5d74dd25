// Sidecar of a model: the hand-written file `<scene>.walk.json` that describes its bodies
// (SIDECAR.md).
#pragma once

#include <filesystem>
#include <set>
#include <stdexcept>
#include <string>
#include <string_view>

#include "scene/model/model.hpp"

namespace enfilade::scene {

/// An error in a sidecar: "file.bodies[2].axis: what is wrong; remedy".
struct SidecarError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Returns the sidecar's path: hall.walk.json for hall.glb, in the same folder.
std::filesystem::path sidecarPath(const std::filesystem::path& model);

/// The content of a sidecar other than its bodies.
struct Sidecar {
  std::set<std::uint32_t> staticObjects;  ///< objects that are static whatever other sources say
};

/// Appends the sidecar's bodies to the model, and an object for each trigger with a box. `source`
/// names the text in errors. Throws SidecarError and then leaves the model unchanged.
Sidecar applySidecar(Model& model, std::string_view text, const std::string& source);

}  // namespace enfilade::scene
