// KHR_implicit_shapes as meshes. All are upright along y and centred at the origin.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>

#include "scene/model/model.hpp"

namespace enfilade::scene {

/// Makes a mesh in the shape's own frame from an entry of KHR_implicit_shapes; nullopt if it is
/// invalid. Round shapes are polytopes with their vertices on the surface.
std::optional<Mesh> makeImplicitShape(const nlohmann::json& shape);

}  // namespace enfilade::scene
