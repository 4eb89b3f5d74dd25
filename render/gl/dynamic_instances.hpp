// Body transforms and avatar meshes of a snapshot on the device, updated only on changes.
#pragma once

#include <memory>
#include <vector>

#include "render/avatar_mesh.hpp"
#include "render/gl/surface_pass.hpp"

namespace enfilade::render {

/// The dynamic part of the scene, as of the last update().
class DynamicInstances {
 public:
  /// Needs a current context.
  void update(const scene::Scene& scene, const scene::Snapshot& snapshot, AvatarForm form);

  const std::vector<BodyPlacement>& bodyPlacements() const { return placements_; }
  const AvatarMeshes& avatars() const { return meshes_; }
  Geometry avatarGeometry(const std::vector<GlTexture>& textures) const {
    return {vertices_.name(), indices_.name(), 0, textures};
  }

 private:
  bool updated_ = false;
  std::shared_ptr<const std::vector<scene::BodySnapshot>>
      snapshotBodies_;  ///< source of `placements_`
  std::vector<BodyPlacement> placements_;
  std::vector<scene::AvatarSnapshot> uploadedAvatars_;  ///< source of `meshes_`
  AvatarForm form_ = AvatarForm::figure;                ///< of `meshes_`
  AvatarMeshes meshes_;
  StreamBuffer vertices_, indices_;
};

}  // namespace enfilade::render
