// What moves, as a snapshot has it: where bodies are drawn, and the meshes of avatars on the
// device. Worked out and uploaded again only when it changed.
#pragma once

#include <memory>
#include <vector>

#include "render/avatar_mesh.hpp"
#include "render/gl/surface_pass.hpp"

namespace enfilade::render {

class MovingThings {
 public:
  /// Needs a current context.
  void follow(const scene::Scene& scene, const scene::Snapshot& snapshot);

  const std::vector<BodyPlacement>& bodies() const { return placements_; }
  const AvatarMeshes& avatars() const { return meshes_; }
  Geometry avatarGeometry(const std::vector<GlTexture>& textures) const {
    return {vertices_.name(), indices_.name(), textures};
  }

 private:
  bool followed_ = false;
  std::shared_ptr<const std::vector<scene::BodyView>> bodies_;  ///< of `placements_`
  std::vector<BodyPlacement> placements_;
  std::vector<scene::AvatarView> drawn_;  ///< of `meshes_`
  AvatarMeshes meshes_;
  StreamBuffer vertices_, indices_;
};

}  // namespace enfilade::render
