// Collects the bodies of a model from all sources. If several sources describe an object, the first
// in this list wins: the sidecar, the imported file itself (KHR_physics_rigid_bodies, extras of
// nodes, name suffixes), IFC doors and elevators. All other objects are static.
#pragma once

#include <filesystem>

#include "scene/model/model.hpp"

namespace enfilade::scene {

/// Whether IFC doors and elevators become bodies if the file describes them well enough.
enum class IfcDoors : std::uint8_t { movable, fixed };

/// Adds the bodies of the sidecar of `file`, if it exists, and those of doors to an imported model.
/// Door frames become separate objects (see splitDoors()). Throws SidecarError.
void collectBodies(Model& model, const std::filesystem::path& file,
                   IfcDoors doors = IfcDoors::movable);

/// Returns a text for users, such as "3 of the sidecar, 5 of ifc".
std::string formatBodySources(const Model& model);

}  // namespace enfilade::scene
