// Collects the bodies of a model from all sources. The first source that describes an object wins.
// The order is: the sidecar, the imported file itself (KHR_physics_rigid_bodies, extras of nodes,
// name suffixes), IFC doors and elevators. All other objects are static.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "scene/model/model.hpp"

namespace enfilade::scene {

/// The treatment of IFC doors that the file describes well enough. Elevators are static with
/// `fixed`, and otherwise move.
enum class IfcDoors : std::uint8_t {
  movable,  ///< bodies that open
  fixed,    ///< static, as in the file
  open,     ///< static, the leaves at their open ends
  absent    ///< without leaves; frames stay
};

/// The words of `--ifc-doors` and of recordings: move, still, open, none. An unknown word means
/// move.
const char* toString(IfcDoors doors);
IfcDoors parseIfcDoors(const std::string& text);

/// Adds the bodies of the sidecar of `file`, if it exists, and those of doors to an imported model.
/// Door frames become separate objects (see splitDoors()). Throws SidecarError.
void collectBodies(Model& model, const std::filesystem::path& file,
                   IfcDoors doors = IfcDoors::movable);

/// Returns a text for users, such as "3 of the sidecar, 5 of ifc".
std::string formatBodySources(const Model& model);

}  // namespace enfilade::scene
