// All that rays can meet, as of a snapshot: what is still, bodies, and people, each with the solid
// apart from the glass. What a picture does not need is not built.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "render/avatar_mesh.hpp"
#include "render/raytrace/ray_tree.hpp"

namespace enfilade::render {

class RayScene {
 public:
  RayScene(std::shared_ptr<const scene::Scene> scene, bool robust, EmbreeFilter maskFilter);

  /// Takes bodies and avatars where `snapshot` has them.
  void follow(const scene::Snapshot& snapshot);

  /// Those that hold anything; built at the first call. Pointers last until the next follow().
  std::vector<const RayTree*> solid();
  std::vector<const RayTree*> glass();

  /// World, metres: rays are to be given relative to it, so that floats lose less far out.
  const Vec3& origin() const { return origin_; }
  const scene::Model& model() const { return scene_->model(); }
  /// Whether any surface is cut out by a texture.
  bool textured() const { return textured_; }

 private:
  /// Of Part::body, which of them: still or not; and of Part::pass.
  std::vector<RayPiece> piecesOf(bool moving, bool glass) const;
  std::optional<RayTree> treeOf(bool moving, bool glass);
  void placeBodies(const scene::Snapshot& snapshot);
  void placePeople(const scene::Snapshot& snapshot);
  void keepMemoryInBounds();

  std::shared_ptr<const scene::Scene> scene_;
  bool robust_;
  EmbreeFilter maskFilter_;
  Vec3 origin_ = Vec3::Zero();
  EmbreeDevice device_;
  MeshTrees meshes_;
  std::vector<Part> parts_;
  std::vector<MaterialData> materials_;  ///< one a mesh
  std::vector<bool> instanced_;          ///< of each part
  bool textured_ = false;

  /// Of each part that belongs to a body; others are where the model has them.
  std::vector<Eigen::Affine3d> worldFromPart_;
  std::shared_ptr<const std::vector<scene::BodyView>> followedBodies_;
  std::vector<scene::AvatarView> followedPeople_;
  std::vector<scene::Mesh> peopleMeshes_;
  std::vector<Eigen::Affine3d> worldFromPeople_;
  std::vector<MaterialData> peopleMaterials_;

  struct Trees {
    bool built = false;
    std::optional<RayTree> tree;  ///< nullopt: there is nothing of the kind
  };
  Trees still_[2], bodies_[2];  ///< solid, glass
  std::optional<RayTree> people_;
};

}  // namespace enfilade::render
