#include "render/raytrace/ray_scene.hpp"

#include <algorithm>
#include <cmath>

#include "render/render_error.hpp"

namespace enfilade::render {
namespace {

// Copied into the tree of the still scene, at some 100 bytes each; in a scene that has more, meshes
// that are placed again and again are stored once, which costs rays about a half more time.
constexpr std::size_t kMostCopied = 4'000'000;

std::size_t trianglesOf(const scene::Mesh& mesh) {
  return mesh.indices.size() / 3;
}

bool alike(const scene::AvatarView& a, const scene::AvatarView& b) {
  return a.id == b.id && a.shape == b.shape && a.feet == b.feet && a.gaze == b.gaze &&
         a.eyeHeight == b.eyeHeight;
}

/// What of `all` is drawn as one piece, as a mesh of its own.
scene::Mesh meshOf(const AvatarMeshes& all, const MeshRange& range) {
  scene::Mesh mesh;
  for (std::uint32_t i = 0; i < range.indexCount; ++i) {
    const std::uint32_t corner = all.indices[range.firstIndex + i];
    mesh.indices.push_back(corner);
    while (mesh.positions.size() <= corner) {
      const auto vertex = static_cast<std::size_t>(range.baseVertex) + mesh.positions.size();
      const float* p = all.vertices[vertex].position;
      mesh.positions.emplace_back(p[0], p[1], p[2]);
    }
  }
  return mesh;
}

}  // namespace

RayScene::RayScene(std::shared_ptr<const scene::Scene> scene, bool robust, EmbreeFilter maskFilter)
    : scene_(std::move(scene)),
      robust_(robust),
      maskFilter_(maskFilter),
      device_(newEmbreeDevice()),
      meshes_(device_.get(), robust) {
  if (!scene_) throw RenderError("RayRenderer: there is no scene");
  const scene::Model& model = scene_->model();
  if (!scene_->bounds().empty()) origin_ = scene_->bounds().centre().array().round().matrix();
  parts_ = partsOf(model);
  for (const scene::Mesh& mesh : model.meshes) materials_.push_back(materialData(model, mesh));
  for (const Part& part : parts_) textured_ |= part.pass == Pass::mask && part.texture >= 0;
  worldFromPart_.resize(model.bodies.empty() ? 0 : parts_.size());
  keepMemoryInBounds();
}

void RayScene::keepMemoryInBounds() {
  std::vector<std::uint32_t> uses(model().meshes.size());
  std::size_t triangles = 0;
  for (const Part& part : parts_) {
    ++uses[part.mesh];
    triangles += trianglesOf(model().meshes[part.mesh]);
  }
  for (const Part& part : parts_) {
    const bool repeated = triangles > kMostCopied && uses[part.mesh] > 1;
    instanced_.push_back(repeated || part.body != kStill);
  }
}

std::vector<RayPiece> RayScene::piecesOf(bool moving, bool glass) const {
  std::vector<RayPiece> pieces;
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    const Part& part = parts_[p];
    if ((part.body != kStill) != moving || (part.pass == Pass::blend) != glass) continue;
    pieces.push_back({&model().meshes[part.mesh],
                      moving ? &worldFromPart_[p] : &model().objects[part.object].worldFromMesh,
                      &materials_[part.mesh], part.object + 1, part.texture, part.pass,
                      instanced_[p]});
  }
  return pieces;
}

std::optional<RayTree> RayScene::treeOf(bool moving, bool glass) {
  std::vector<RayPiece> pieces = piecesOf(moving, glass);
  if (pieces.empty()) return std::nullopt;
  return RayTree(device_.get(), robust_, std::move(pieces), origin_, maskFilter_, meshes_);
}

void RayScene::follow(const scene::Snapshot& snapshot) {
  placeBodies(snapshot);
  placePeople(snapshot);
}

void RayScene::placeBodies(const scene::Snapshot& snapshot) {
  if (worldFromPart_.empty()) return;
  const bool fresh = !followedBodies_ || followedBodies_ != snapshot.bodies;
  if (!fresh) return;
  const std::vector<BodyPlacement> bodies = placementsOf(*scene_, snapshot);
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    const Part& part = parts_[p];
    if (part.body == kStill) continue;
    worldFromPart_[p] = model().objects[part.object].worldFromMesh;
    if (!bodies[part.body].displaced) continue;
    worldFromPart_[p] = bodies[part.body].sceneFromAuthored * worldFromPart_[p];
  }
  for (Trees& trees : bodies_) trees = {};
  followedBodies_ = snapshot.bodies;
}

void RayScene::placePeople(const scene::Snapshot& snapshot) {
  if (std::equal(snapshot.avatars.begin(), snapshot.avatars.end(), followedPeople_.begin(),
                 followedPeople_.end(), alike)) {
    return;
  }
  people_.reset();
  followedPeople_.clear();  // until they are all placed
  peopleMeshes_.clear();
  worldFromPeople_.clear();
  peopleMaterials_.clear();
  const AvatarMeshes all = avatarMeshes(snapshot, 0);
  for (const AvatarMeshes::Piece& piece : all.pieces) {
    peopleMeshes_.push_back(meshOf(all, piece.range));
    worldFromPeople_.emplace_back(Eigen::Translation3d(piece.feet));
    peopleMaterials_.push_back(piece.material);
  }
  std::vector<RayPiece> pieces;
  for (std::size_t i = 0; i < all.pieces.size(); ++i) {
    pieces.push_back(
        {&peopleMeshes_[i], &worldFromPeople_[i], &peopleMaterials_[i], all.pieces[i].id});
  }
  if (!pieces.empty())
    people_.emplace(device_.get(), robust_, std::move(pieces), origin_, nullptr, meshes_);
  followedPeople_ = snapshot.avatars;
}

std::vector<const RayTree*> RayScene::solid() {
  std::vector<const RayTree*> trees;
  for (const bool moving : {false, true}) {
    Trees& kept = (moving ? bodies_ : still_)[0];
    if (!kept.built) kept = {true, treeOf(moving, false)};
    if (kept.tree) trees.push_back(&*kept.tree);
  }
  if (people_) trees.push_back(&*people_);
  return trees;
}

std::vector<const RayTree*> RayScene::glass() {
  std::vector<const RayTree*> trees;
  for (const bool moving : {false, true}) {
    Trees& kept = (moving ? bodies_ : still_)[1];
    if (!kept.built) kept = {true, treeOf(moving, true)};
    if (kept.tree) trees.push_back(&*kept.tree);
  }
  return trees;
}

}  // namespace enfilade::render
