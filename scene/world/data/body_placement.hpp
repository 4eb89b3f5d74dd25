// The transforms of bodies in a snapshot, for pictures and rays.
#pragma once

#include <vector>

#include "collision/assert.hpp"
#include "scene/world/data/scene.hpp"
#include "scene/world/data/snapshot.hpp"

namespace enfilade::scene {

/// A body's current transform: sceneFromAuthored maps a point of the model to the body's pose.
struct BodyPlacement {
  bool displaced = false;  ///< false: as in the model
  Eigen::Affine3d sceneFromAuthored = Eigen::Affine3d::Identity();
  bool operator==(const BodyPlacement& other) const {
    return displaced == other.displaced &&
           sceneFromAuthored.matrix() == other.sceneFromAuthored.matrix();
  }
};

/// The transforms of all bodies of the scene, by index.
inline std::vector<BodyPlacement> computeBodyPlacements(const Scene& scene,
                                                        const Snapshot& snapshot) {
  std::vector<BodyPlacement> placements(scene.model().bodies.size());
  if (!snapshot.bodies) return placements;
  for (const BodySnapshot& body : *snapshot.bodies) {
    if (!body.displaced) continue;
    ENFILADE_ASSERT(body.index < placements.size());
    placements[body.index] = {true,
                              computeWorldFromAuthored(*scene.bodyShape(body.index), body.pose)};
  }
  return placements;
}

}  // namespace enfilade::scene
