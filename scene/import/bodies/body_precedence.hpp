// Which source has the say over an object, where several name it.
#pragma once

#include <set>
#include <vector>

#include "scene/model/model.hpp"

namespace enfilade::scene {

/// Appends bodies of one lower source to the model's. One that shares an object with a body that is
/// there already is left out, and counted as the problem `replaced_bodies`; objects in `still` are
/// taken out of theirs, and a body without any is none. Names that are taken get "#2", ...
/// The bodies themselves share no objects.
void addLowerBodies(Model& model, std::vector<BodySpec> bodies,
                    const std::set<std::uint32_t>& still);

/// Collision shapes join the bodies of what they stand for, if they are in none.
void takeCollisionShapesAlong(Model& model);

/// Counts a problem of the model, and keeps the first example.
void addProblem(Model& model, const char* kind, const std::string& example, std::size_t count = 1);

}  // namespace enfilade::scene
