// What a driven body is mounted on: what it touches or penetrates (d < 2 epsilon, by the exact
// verdict) where it stands when a world begins, as a door its frame, a lift the floor of its shaft,
// a cart the ground. No contact and no near miss of such a pair is told: it is so as the model was
// made. It follows from the scene alone, and is worked out when it is first asked for.
#pragma once

#include <vector>

#include "scene/world/data/scene.hpp"
#include "scene/world/data/snapshot.hpp"

namespace enfilade::scene {

/// Where a driven body begins.
collision::Pose startPoseOf(const BodySpec& spec);

/// Whether body `body` (index into Model::bodies, driven) begins nearer than `contact` metres to
/// `other`: a still object, or another driven body.
bool isMountedOn(const Scene& scene, std::uint32_t body, EntityId other, double contact);

/// All that it is mounted on, ascending; none for a body that is not driven.
std::vector<EntityId> mountingOf(const Scene& scene, std::uint32_t body, double contact);

}  // namespace enfilade::scene
