#include "scene/world/queries/scene_trees.hpp"

#include <algorithm>

namespace enfilade::scene {
namespace {

// Triangles copied into the static tree, at about 100 bytes each. In larger scenes, repeated meshes
// are instanced, which makes tracing about a half slower.
constexpr std::size_t kMaxCopiedTriangles = 4'000'000;
// Instances of bodies in all sets of places that are kept, at about 1 kB each; and the sets.
constexpr std::size_t kMaxBodyInstances = 16'384, kMinBodyStates = 4, kMaxBodyStates = 64;

}  // namespace

SceneTrees& SceneTrees::of(const Scene& scene) {
  return scene.trees([&] { return std::make_shared<SceneTrees>(scene); });
}

SceneTrees::SceneTrees(const Scene& scene) : scene_(scene), items_(scene.drawItems()) {
  if (!scene.bounds().empty()) origin_ = scene.bounds().centre().array().round().matrix();
  for (std::size_t i = 0; i < items_.size(); ++i)
    (items_[i].isStatic() ? staticItems_ : bodyItems_).push_back(i);
  chooseInstancing();
}

void SceneTrees::chooseInstancing() {
  const std::vector<Mesh>& meshes = scene_.model().meshes;
  std::vector<std::uint32_t> uses(meshes.size());
  std::size_t triangles = 0;
  for (const DrawItem& item : items_) {
    ++uses[item.mesh];
    triangles += meshes[item.mesh].triangleCount();
  }
  for (const DrawItem& item : items_) {
    const bool repeated = triangles > kMaxCopiedTriangles && uses[item.mesh] > 1;
    instanced_.push_back(repeated || !item.isStatic());
  }
}

std::shared_ptr<PlacedItems> SceneTrees::placeItems(std::vector<BodyPlacement> placements) const {
  auto placed = std::make_shared<PlacedItems>();
  placed->placements = std::move(placements);
  for (const std::size_t i : bodyItems_) {
    const BodyPlacement& body = placed->placements[items_[i].body];
    const Eigen::Affine3d& authored = scene_.model().objects[items_[i].object].worldFromMesh;
    placed->worldFromItem.push_back(body.displaced ? body.sceneFromAuthored * authored : authored);
  }
  return placed;
}

std::shared_ptr<PlacedItems> SceneTrees::placeBodies(const Snapshot& snapshot) {
  if (bodyItems_.empty()) return nullptr;
  const std::lock_guard lock(mutex_);
  auto known = std::ranges::find_if(bodies_, [&](const auto& placed) {
    return snapshot.bodies && placed->snapshot == snapshot.bodies;
  });
  if (known == bodies_.end()) {
    std::vector<BodyPlacement> placements = computeBodyPlacements(scene_, snapshot);
    known = std::ranges::find_if(
        bodies_, [&](const auto& placed) { return placed->placements == placements; });
    if (known == bodies_.end())
      known = bodies_.insert(bodies_.end(), placeItems(std::move(placements)));
  }
  bodies_.splice(bodies_.begin(), bodies_, known);
  bodies_.front()->snapshot = snapshot.bodies;
  const std::size_t kept =
      std::clamp(kMaxBodyInstances / bodyItems_.size(), kMinBodyStates, kMaxBodyStates);
  if (bodies_.size() > kept) bodies_.pop_back();
  return bodies_.front();
}

std::vector<TriangleBatch> SceneTrees::collectBatches(const PlacedItems& placed,
                                                      bool transparent) const {
  const Model& model = scene_.model();
  const bool isStatic = &placed == static_.get();
  const std::vector<std::size_t>& items = isStatic ? staticItems_ : bodyItems_;
  std::vector<TriangleBatch> batches;
  for (std::size_t k = 0; k < items.size(); ++k) {
    const DrawItem& item = items_[items[k]];
    if ((item.alphaMode == Material::Alpha::blend) != transparent) continue;
    const Mesh& mesh = model.meshes[item.mesh];
    TriangleBatch batch{
        &mesh, isStatic ? &model.objects[item.object].worldFromMesh : &placed.worldFromItem[k]};
    batch.material = &findMaterial(model, mesh);
    batch.id = item.object + 1;
    batch.entity = (isStatic ? item.object : model.bodies[item.body].objects.front()) + 1;
    batch.texture = item.texture;
    batch.coplanar = &scene_.coplanarRanks()[item.object];
    batch.instanced = instanced_[items[k]];
    batches.push_back(batch);
  }
  return batches;
}

const RayTree* SceneTrees::findOrBuildTree(PlacedItems& placed, bool transparent) {
  const std::lock_guard lock(mutex_);
  PlacedItems::LazyTree& lazy = placed.trees[transparent];
  if (!lazy.built) {
    std::vector<TriangleBatch> batches = collectBatches(placed, transparent);
    if (!batches.empty()) {
      lazy.tree.emplace(meshes_, std::move(batches), origin_);
      ++placedTrees_;
    }
    lazy.built = true;
  }
  return lazy.tree ? &*lazy.tree : nullptr;
}

RayTree SceneTrees::buildTree(std::vector<TriangleBatch> batches) {
  const std::lock_guard lock(mutex_);
  return RayTree(meshes_, std::move(batches), origin_);
}

SceneTrees::Counts SceneTrees::counts() const {
  const std::lock_guard lock(mutex_);
  return {meshes_.builtCount(), placedTrees_};
}

}  // namespace enfilade::scene
