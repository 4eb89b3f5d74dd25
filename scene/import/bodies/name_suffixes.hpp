// Bodies and collision shapes from object names, by the conventions of two game engines:
//
//   Chair-col, -convcol          static and solid, as all objects are (Godot's import hints)
//   Chair-colonly, -convcolonly  invisible: the collision shape of Chair, or a separate wall
//   Chair-rigid                  a dynamic body
//   UCX_Chair, UCX_Chair_01      invisible: a collision shape of Chair (Unreal); also UBX_, UCP_,
//   USP_
//
// Suffixes that modellers append to repeated names (".001", and our "#2") do not count.
#pragma once

#include <cstdint>
#include <set>

#include "scene/model/model.hpp"

namespace enfilade::scene {

/// Adds the bodies that object names declare by suffix or prefix, except for `staticObjects`.
void addNamedBodies(Model& model, const std::set<std::uint32_t>& staticObjects);

}  // namespace enfilade::scene
