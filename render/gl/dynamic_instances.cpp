#include "render/gl/dynamic_instances.hpp"

#include <algorithm>

namespace enfilade::render {

void DynamicInstances::update(const scene::Scene& scene, const scene::Snapshot& snapshot,
                              AvatarForm form) {
  // Consecutive snapshots share the bodies if no body changed.
  if (!updated_ || snapshot.bodies != snapshotBodies_) {
    placements_ = computeBodyPlacements(scene, snapshot);
    snapshotBodies_ = snapshot.bodies;
  }
  updated_ = true;
  if (form == form_ &&
      std::equal(uploadedAvatars_.begin(), uploadedAvatars_.end(), snapshot.avatars.begin(),
                 snapshot.avatars.end(), hasSameAppearance)) {
    return;
  }
  uploadedAvatars_ = snapshot.avatars;
  form_ = form;
  meshes_ = buildAvatarMeshes(snapshot.avatars, form);
  vertices_.fill(meshes_.vertices.data(), meshes_.vertices.size() * sizeof(Vertex));
  indices_.fill(meshes_.indices.data(), meshes_.indices.size() * sizeof(std::uint32_t));
}

}  // namespace enfilade::render
