#include "render/raytrace/ray_scene.hpp"

#include <algorithm>

#include "render/render_error.hpp"

namespace enfilade::render {
namespace {

/// The result of `make`; turns an EmbreeError into a RenderError.
template <class Make>
auto callEmbree(const Make& make) {
  try {
    return make();
  } catch (const scene::EmbreeError& error) {
    throw RenderError(error.what());
  }
}

/// Extracts one item's mesh.
scene::Mesh extractMesh(const AvatarMeshes& all, const MeshRange& range) {
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

RayScene::RayScene(std::shared_ptr<const scene::Scene> scene) : scene_(std::move(scene)) {
  if (!scene_) throw RenderError("RayRenderer: there is no scene");
  trees_ = callEmbree([&] { return &scene::SceneTrees::of(*scene_); });
}

void RayScene::update(const scene::Snapshot& snapshot, AvatarForm form) {
  bodies_ = trees_->placeBodies(snapshot);
  updateAvatars(snapshot, form);
}

void RayScene::updateAvatars(const scene::Snapshot& snapshot, AvatarForm form) {
  if (form == avatarForm_ &&
      std::equal(snapshot.avatars.begin(), snapshot.avatars.end(), currentAvatars_.begin(),
                 currentAvatars_.end(), hasSameAppearance)) {
    return;
  }
  avatarTree_.reset();
  avatarTreeBuilt_ = false;
  currentAvatars_ = snapshot.avatars;
  avatarForm_ = form;
}

void RayScene::buildAvatarTree() {
  avatars_ = buildAvatarMeshes(currentAvatars_, avatarForm_);
  avatarMeshes_.clear();
  for (const AvatarMeshes::Item& item : avatars_.items)
    avatarMeshes_.push_back(item.figure ? scene::Mesh{} : extractMesh(avatars_, item.range));
  std::vector<TriangleBatch> batches;
  for (std::size_t i = 0; i < avatars_.items.size(); ++i) {
    const AvatarMeshes::Item& item = avatars_.items[i];
    TriangleBatch batch{item.figure ? item.figure : &avatarMeshes_[i], &item.worldFromMesh,
                        &item.material, item.id, item.id};
    batch.instanced = item.figure != nullptr;
    batches.push_back(batch);
  }
  if (!batches.empty())
    avatarTree_ = callEmbree([&] { return trees_->buildTree(std::move(batches)); });
  avatarTreeBuilt_ = true;
}

std::vector<const RayTree*> RayScene::itemTrees(bool isTransparent) {
  std::vector<const RayTree*> trees;
  for (scene::PlacedItems* placed : {trees_->staticItems().get(), bodies_.get()}) {
    if (!placed) continue;
    const RayTree* tree =
        callEmbree([&] { return trees_->findOrBuildTree(*placed, isTransparent); });
    if (tree) trees.push_back(tree);
  }
  return trees;
}

std::vector<const RayTree*> RayScene::opaqueTrees(scene::EntityId hiddenEntity) {
  std::vector<const RayTree*> trees = itemTrees(false);
  const bool anyVisible = std::ranges::any_of(
      currentAvatars_, [&](const scene::AvatarSnapshot& one) { return one.id != hiddenEntity; });
  if (!anyVisible) return trees;
  if (!avatarTreeBuilt_) buildAvatarTree();
  if (avatarTree_) trees.push_back(&*avatarTree_);
  return trees;
}

}  // namespace enfilade::render
