// The sidecar of a model: what moves in it, told by hand in `<scene>.walk.json` (SIDECAR.md).
#pragma once

#include <filesystem>
#include <set>
#include <stdexcept>
#include <string>
#include <string_view>

#include "scene/model/model.hpp"

namespace enfilade::scene {

/// "file.bodies[2].axis: what is wrong; remedy".
struct SidecarError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// hall.glb -> hall.walk.json, beside it.
std::filesystem::path sidecarOf(const std::filesystem::path& model);

/// What a sidecar says besides its bodies.
struct Sidecar {
  std::set<std::uint32_t> still;  ///< objects that are no bodies, whatever else says so
};

/// Appends the sidecar's bodies to the model, and an object for each trigger that is given as a
/// box. `source` names the text in errors. Throws SidecarError; the model is then as before.
Sidecar applySidecar(Model& model, std::string_view text, const std::string& source);

}  // namespace enfilade::scene
