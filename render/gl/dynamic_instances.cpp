#include "render/gl/dynamic_instances.hpp"

#include <algorithm>

namespace enfilade::render {
namespace {

bool looksTheSame(const scene::AvatarView& a, const scene::AvatarView& b) {
  return a.id == b.id && a.shape == b.shape && a.feet == b.feet && a.gaze == b.gaze &&
         a.eyeHeight == b.eyeHeight;
}

}  // namespace

void MovingThings::follow(const scene::Scene& scene, const scene::Snapshot& snapshot) {
  // A snapshot shares its bodies with the last one when nothing of them changed.
  if (!followed_ || snapshot.bodies != bodies_) {
    placements_ = placementsOf(scene, snapshot);
    bodies_ = snapshot.bodies;
  }
  followed_ = true;
  if (std::equal(drawn_.begin(), drawn_.end(), snapshot.avatars.begin(), snapshot.avatars.end(),
                 looksTheSame)) {
    return;
  }
  drawn_ = snapshot.avatars;
  meshes_ = avatarMeshes(snapshot, 0);
  vertices_.fill(meshes_.vertices.data(), meshes_.vertices.size() * sizeof(Vertex));
  indices_.fill(meshes_.indices.data(), meshes_.indices.size() * sizeof(std::uint32_t));
}

}  // namespace enfilade::render
