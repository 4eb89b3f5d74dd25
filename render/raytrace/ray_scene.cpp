#include "render/raytrace/ray_scene.hpp"

#include <algorithm>
#include <cmath>

#include "render/render_error.hpp"

namespace enfilade::render {
namespace {

// Triangles copied into the static tree, at about 100 bytes each. In larger scenes, repeated meshes
// are instanced, which makes tracing about a half slower.
constexpr std::size_t kMaxCopiedTriangles = 4'000'000;

/// The result of `make`; turns an EmbreeError into a RenderError.
template <class Make>
auto orRenderError(const Make& make) {
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

RayScene::RayScene(std::shared_ptr<const scene::Scene> scene, bool robust,
                   scene::EmbreeFilter maskFilter)
    : scene_(std::move(scene)),
      maskFilter_(maskFilter),
      meshes_(orRenderError([&] { return scene::MeshTrees({.robust = robust}); })) {
  if (!scene_) throw RenderError("RayRenderer: there is no scene");
  const scene::Model& model = scene_->model();
  if (!scene_->bounds().empty()) origin_ = scene_->bounds().centre().array().round().matrix();
  items_ = buildDrawItems(model);
  for (const scene::Mesh& mesh : model.meshes) materials_.push_back(makeMaterialData(model, mesh));
  for (std::size_t i = 0; i < items_.size(); ++i)
    if (items_[i].body != kNoBody) bodyItems_.push_back(i);
  chooseInstancing();
}

void RayScene::chooseInstancing() {
  std::vector<std::uint32_t> uses(model().meshes.size());
  std::size_t triangles = 0;
  for (const DrawItem& item : items_) {
    ++uses[item.mesh];
    triangles += model().meshes[item.mesh].triangleCount();
  }
  for (const DrawItem& item : items_) {
    const bool repeated = triangles > kMaxCopiedTriangles && uses[item.mesh] > 1;
    instanced_.push_back(repeated || item.body != kNoBody);
  }
}

std::vector<TriangleBatch> RayScene::collectBatches(bool isDynamic, bool transparent) const {
  std::vector<TriangleBatch> batches;
  const auto add = [&](std::size_t i, const Eigen::Affine3d& worldFromMesh) {
    const DrawItem& item = items_[i];
    if ((item.alphaMode == AlphaMode::blend) != transparent) return;
    batches.push_back({&model().meshes[item.mesh], &worldFromMesh, &materials_[item.mesh],
                       item.object + 1, item.texture, item.alphaMode, instanced_[i]});
  };
  if (isDynamic) {
    for (std::size_t k = 0; k < bodyItems_.size(); ++k)
      add(bodyItems_[k], bodyStates_.front().worldFromItem[k]);
  } else {
    for (std::size_t i = 0; i < items_.size(); ++i)
      if (items_[i].body == kNoBody) add(i, model().objects[items_[i].object].worldFromMesh);
  }
  return batches;
}

std::optional<RayTree> RayScene::buildTree(std::vector<TriangleBatch> batches) {
  if (batches.empty()) return std::nullopt;
  return orRenderError([&] { return RayTree(meshes_, std::move(batches), origin_, maskFilter_); });
}

void RayScene::update(const scene::Snapshot& snapshot, AvatarForm form) {
  updateBodies(snapshot);
  updateAvatars(snapshot, form);
}

void RayScene::updateBodies(const scene::Snapshot& snapshot) {
  constexpr std::size_t kMaxStates = 64;
  if (bodyItems_.empty()) return;
  auto known = std::ranges::find_if(bodyStates_, [&](const BodyState& state) {
    return snapshot.bodies && state.snapshot == snapshot.bodies;
  });
  std::vector<BodyPlacement> placements;
  if (known == bodyStates_.end()) {
    placements = computeBodyPlacements(*scene_, snapshot);
    known = std::ranges::find(bodyStates_, placements, &BodyState::placements);
  }
  if (known != bodyStates_.end()) {
    bodyStates_.splice(bodyStates_.begin(), bodyStates_, known);
    bodyStates_.front().snapshot = snapshot.bodies;
    return;
  }
  BodyState state{snapshot.bodies, std::move(placements), {}, {}};
  for (const std::size_t i : bodyItems_) {
    const BodyPlacement& body = state.placements[items_[i].body];
    const Eigen::Affine3d& authored = model().objects[items_[i].object].worldFromMesh;
    state.worldFromItem.push_back(body.displaced ? body.sceneFromAuthored * authored : authored);
  }
  bodyStates_.push_front(std::move(state));
  if (bodyStates_.size() > kMaxStates) bodyStates_.pop_back();
}

void RayScene::updateAvatars(const scene::Snapshot& snapshot, AvatarForm form) {
  if (form == avatarForm_ &&
      std::equal(snapshot.avatars.begin(), snapshot.avatars.end(), currentAvatars_.begin(),
                 currentAvatars_.end(), hasSameAppearance)) {
    return;
  }
  avatarTree_ = {};
  currentAvatars_ = snapshot.avatars;
  avatarForm_ = form;
}

void RayScene::buildAvatarTree() {
  avatarMeshes_.clear();
  worldFromAvatars_.clear();
  avatarMaterials_.clear();
  const AvatarMeshes all = buildAvatarMeshes(currentAvatars_, avatarForm_);
  for (const AvatarMeshes::Item& avatarItem : all.items) {
    avatarMeshes_.push_back(avatarItem.figure ? scene::Mesh{} : extractMesh(all, avatarItem.range));
    worldFromAvatars_.push_back(avatarItem.worldFromMesh);
    avatarMaterials_.push_back(avatarItem.material);
  }
  std::vector<TriangleBatch> batches;
  for (std::size_t i = 0; i < all.items.size(); ++i) {
    const scene::Mesh* figure = all.items[i].figure;
    batches.push_back({figure ? figure : &avatarMeshes_[i], &worldFromAvatars_[i],
                       &avatarMaterials_[i], all.items[i].id});
    batches.back().instanced = figure != nullptr;
  }
  avatarTree_ = {true, buildTree(std::move(batches))};
}

std::vector<const RayTree*> RayScene::itemTrees(bool isTransparent) {
  std::vector<const RayTree*> trees;
  for (const bool isDynamic : {false, true}) {
    if (isDynamic && bodyItems_.empty()) continue;
    LazyTree& lazyTree = (isDynamic ? bodyStates_.front().trees : staticTrees_)[isTransparent];
    if (!lazyTree.built) lazyTree = {true, buildTree(collectBatches(isDynamic, isTransparent))};
    if (lazyTree.tree) trees.push_back(&*lazyTree.tree);
  }
  return trees;
}

std::vector<const RayTree*> RayScene::opaqueTrees(scene::EntityId hiddenEntity) {
  std::vector<const RayTree*> trees = itemTrees(false);
  const bool anyVisible = std::ranges::any_of(
      currentAvatars_, [&](const scene::AvatarSnapshot& one) { return one.id != hiddenEntity; });
  if (!anyVisible) return trees;
  if (!avatarTree_.built) buildAvatarTree();
  if (avatarTree_.tree) trees.push_back(&*avatarTree_.tree);
  return trees;
}

}  // namespace enfilade::render
