// What moves in a model, from all that says so. The first that names an object has the say over it:
// the sidecar, then what the import read from the file itself (KHR_physics_rigid_bodies, extras of
// nodes, suffixes of names), then IFC's doors and lifts. All else is still.
#pragma once

#include <filesystem>

#include "scene/model/model.hpp"

namespace enfilade::scene {

/// Whether doors and lifts of IFC are bodies where the file says enough of them.
enum class IfcDoors : std::uint8_t { move, still };

/// Completes the bodies of a model as it was imported: with those of the sidecar beside `file`, if
/// there is one, and with doors, whose frames become objects of their own (see splitDoors()).
/// Throws SidecarError.
void findBodies(Model& model, const std::filesystem::path& file, IfcDoors doors = IfcDoors::move);

/// "3 of the sidecar, 5 of ifc", for people.
std::string sourcesOf(const Model& model);

}  // namespace enfilade::scene
