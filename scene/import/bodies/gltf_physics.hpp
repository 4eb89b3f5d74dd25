// Reads KHR_physics_rigid_bodies (draft of 2024): motion with mass and velocity, colliders with
// shapes and materials, and triggers. Also reads joints with one degree of freedom between a body
// and a static node. The rest is reported, not guessed.
#pragma once

#include <vector>

#include "scene/import/bodies/gltf_tree.hpp"

namespace enfilade::scene {

/// Reads the bodies of KHR_physics_rigid_bodies and adds their collision shapes to the model.
/// Unsupported features are counted as `unsupported_physics`.
std::vector<BodySpec> readPhysicsBodies(GltfTree& tree);

}  // namespace enfilade::scene
