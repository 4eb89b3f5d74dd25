#include "scene/world/data/scene.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <condition_variable>
#include <deque>
#include <future>
#include <map>
#include <mutex>
#include <set>
#include <stdexcept>
#include <system_error>
#include <thread>

#include "scene/model/hasher.hpp"
#include "scene/model/object_box.hpp"

namespace enfilade::scene {

/// Array of lazily created items. Two threads that request an item at once may both create it; the
/// first one stored is kept, and both threads get it.
template <class T>
struct Scene::LazyArray {
  explicit LazyArray(std::size_t count) : items(new std::atomic<const T*>[count]()), size(count) {}
  ~LazyArray() {
    for (std::size_t i = 0; i < size; ++i) delete items[i].load();
  }
  LazyArray(const LazyArray&) = delete;
  LazyArray& operator=(const LazyArray&) = delete;

  template <class Make>
  const T& get(std::size_t i, const Make& make) {
    if (const T* created = items[i].load(std::memory_order_acquire)) return *created;
    auto own = std::make_unique<const T>(make());
    const T* first = nullptr;
    if (items[i].compare_exchange_strong(first, own.get())) return *own.release();
    return *first;
  }
  bool has(std::size_t i) const { return items[i].load(std::memory_order_relaxed) != nullptr; }
  std::size_t bytes() const {
    std::size_t sum = 0;
    for (std::size_t i = 0; i < size; ++i) {
      if (const T* created = items[i].load()) sum += sizeof *created + created->bytes();
    }
    return sum;
  }

  std::unique_ptr<std::atomic<const T*>[]> items;
  std::size_t size;
};

/// A thread that builds collision geometry, from the first request on.
class Scene::Prefetcher {
 public:
  explicit Prefetcher(const Scene& scene) : scene_(scene) {}

  void add(std::span<const std::uint32_t> objects) {
    const std::lock_guard lock(mutex_);
    try {
      if (!thread_.joinable()) thread_ = std::jthread([this](std::stop_token stop) { run(stop); });
    } catch (const std::system_error&) {
      return;  // without a thread the ticks build what they need
    }
    for (const std::uint32_t object : objects)
      if (requested_.insert(object).second) queue_.push_back(object);
    wakeUp_.notify_one();
  }

 private:
  void run(const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    while (wakeUp_.wait(lock, stop, [this] { return !queue_.empty(); }) && !stop.stop_requested()) {
      const std::uint32_t object = queue_.front();
      queue_.pop_front();
      lock.unlock();
      try {
        scene_.collisionGeometry(object);
      } catch (const std::exception&) {
        // The tick that needs the geometry reports the error.
      }
      lock.lock();
    }
  }

  const Scene& scene_;
  std::mutex mutex_;
  std::condition_variable_any wakeUp_;
  std::deque<std::uint32_t> queue_;
  std::set<std::uint32_t> requested_;  ///< all objects queued since construction
  std::jthread thread_;                ///< last: stops before the rest goes
};

namespace {

constexpr std::size_t kManyTriangles = 64;  // the trees of fewer take some microseconds

std::uint64_t hashMesh(const Mesh& mesh) {
  Hasher hash;
  hash.add(std::uint64_t{mesh.positions.size()});
  for (const Eigen::Vector3f& p : mesh.positions) {
    hash.add(static_cast<double>(p.x()));
    hash.add(static_cast<double>(p.y()));
    hash.add(static_cast<double>(p.z()));
  }
  hash.add(std::uint64_t{mesh.indices.size()});
  for (const std::uint32_t index : mesh.indices) hash.add(std::uint64_t{index});
  return hash.value();
}

/// A scene without bodies adds nothing.
void addBodiesToHash(Hasher& hash, const std::vector<BodySpec>& bodies) {
  for (const BodySpec& body : bodies) {
    hash.add(std::string_view(body.name));
    hash.add(static_cast<std::uint64_t>(body.kind));
    for (const std::uint32_t object : body.objects) hash.add(std::uint64_t{object});
    hash.add(body.anchor);
    hash.add(body.axis);
    for (const double number : {body.low, body.high, body.closedPosition, body.speed,
                                body.acceleration, body.autoCloseDelay.value_or(-1), body.density,
                                body.mass.value_or(-1), body.friction, body.restitution})
      hash.add(number);
    for (const double hit : body.stops) hash.add(hit);
    hash.add(static_cast<std::uint64_t>(body.openedBy));
    hash.add((std::uint64_t{body.loops} << 1) | std::uint64_t{body.autoStart});
    if (!body.velocity.isZero(0) || !body.angularVelocity.isZero(0)) {
      hash.add(body.velocity);
      hash.add(body.angularVelocity);
    }
    for (const PathKey& key : body.keys) {
      hash.add(key.time);
      hash.add(key.offset);
      hash.add(key.angle);
    }
  }
}

/// Hashes each mesh once, so that a scene with many instances stays cheap.
std::uint64_t hashModel(const Model& model) {
  std::vector<std::uint64_t> meshHashes;
  for (const Mesh& mesh : model.meshes) meshHashes.push_back(hashMesh(mesh));
  Hasher hash;
  hash.add(std::uint64_t{model.objects.size()});
  for (const Object& object : model.objects) {
    hash.add(std::string_view(object.path));
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 4; ++column) hash.add(object.worldFromMesh(row, column));
    }
    hash.add(std::uint64_t{object.meshes.size()});
    for (const std::uint32_t mesh : object.meshes) hash.add(meshHashes[mesh]);
    if (object.usage != Object::Usage::both) hash.add(static_cast<std::uint64_t>(object.usage));
  }
  addBodiesToHash(hash, model.bodies);
  return hash.value();
}

/// Whether positions of so few that a linear search is quick contain one.
bool containsPosition(const std::vector<Eigen::Vector3f>& positions, const Eigen::Vector3f& p) {
  constexpr std::size_t kFew = 64;
  return positions.size() <= kFew && std::ranges::find(positions, p) != positions.end();
}

/// Positions used by triangles with an area. Small meshes repeat a position for each normal; it is
/// listed once.
std::vector<Eigen::Vector3f> collectSolidPositions(const Model& model,
                                                   const std::vector<std::uint32_t>& meshes) {
  std::vector<Eigen::Vector3f> positions;
  std::vector<bool> used;
  for (const std::uint32_t index : meshes) {
    const Mesh& mesh = model.meshes[index];
    used.assign(mesh.positions.size(), false);
    for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
      const std::array<std::uint32_t, 3> t{mesh.indices[i], mesh.indices[i + 1],
                                           mesh.indices[i + 2]};
      if (!hasExactArea(mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]])) continue;
      for (const std::uint32_t corner : t) {
        if (!used[corner] && !containsPosition(positions, mesh.positions[corner]))
          positions.push_back(mesh.positions[corner]);
        used[corner] = true;
      }
    }
  }
  return positions;
}

/// False if the transform maps all of space onto a line, which leaves no area.
bool preservesArea(const Eigen::Affine3d& placed) {
  const auto& m = placed.linear();
  return !(m.col(0).cross(m.col(1)).isZero(0.0) && m.col(1).cross(m.col(2)).isZero(0.0) &&
           m.col(2).cross(m.col(0)).isZero(0.0));
}

constexpr std::uint32_t kNoShape = 0xffffffff;

void requireObject(const Model& model, std::uint32_t object) {
  if (object < model.objects.size()) return;
  throw std::out_of_range("object " + std::to_string(object) + " of " +
                          std::to_string(model.objects.size()));
}

void requireValidMeshes(const Model& model) {
  for (const Mesh& mesh : model.meshes) {
    for (const std::uint32_t index : mesh.indices) {
      if (index >= mesh.positions.size()) {
        throw std::invalid_argument("mesh '" + mesh.name + "': index " + std::to_string(index) +
                                    " but only " + std::to_string(mesh.positions.size()) +
                                    " positions");
      }
    }
  }
}

/// True if the meshes have so many triangles that the collision geometry of an object is built
/// before avatars come near.
bool hasManyTriangles(const Model& model, const std::vector<std::uint32_t>& meshes) {
  std::size_t triangles = 0;
  for (const std::uint32_t mesh : meshes) triangles += model.meshes[mesh].indices.size() / 3;
  return triangles > kManyTriangles;
}

}  // namespace

Scene::Scene(Model model) : model_(std::move(model)) {
  requireValidMeshes(model_);
  assignShapeIndices();
  if (const auto error = validateBodies(model_)) throw std::invalid_argument(*error);
  std::vector<bool> isBodyObject(model_.objects.size());
  MeshShapeCache meshShapes;
  for (const BodySpec& body : model_.bodies) {
    for (const std::uint32_t object : body.objects) isBodyObject[object] = true;
    bodyShapes_.push_back(
        std::make_shared<const BodyShape>(buildBodyShape(model_, body, meshShapes)));
  }
  computeHashAndBoxes(isBodyObject);
  shapes_ = std::make_unique<LazyArray<Shape>>(meshesOfShape_.size());
  collisionGeometries_ = std::make_unique<LazyArray<CollisionGeometry>>(model_.objects.size());
  std::vector<bool> isDense;  // by shape
  for (const auto& meshes : meshesOfShape_) isDense.push_back(hasManyTriangles(model_, meshes));
  for (std::uint32_t i = 0; i < solidObjects_.size(); ++i)
    if (isDense[shapeIndexOfObject_[solidObjects_[i]]]) denseIndices_.push_back(i);
  prefetcher_ = std::make_unique<Prefetcher>(*this);
}

Scene::~Scene() = default;

/// Throws std::invalid_argument for meshes that do not exist.
void Scene::assignShapeIndices() {
  std::map<std::vector<std::uint32_t>, std::uint32_t> indexOfMeshes;
  std::vector<std::uint32_t> indexOfMesh(model_.meshes.size(),
                                         kNoShape);  // for single-mesh objects
  shapeIndexOfObject_.reserve(model_.objects.size());
  for (const Object& object : model_.objects) {
    for (const std::uint32_t mesh : object.meshes)
      if (mesh >= model_.meshes.size())
        throw std::invalid_argument("object '" + object.path + "': no mesh " +
                                    std::to_string(mesh));
    const auto next = static_cast<std::uint32_t>(meshesOfShape_.size());
    std::uint32_t index = next;
    if (object.meshes.size() == 1) {
      std::uint32_t& knownIndex = indexOfMesh[object.meshes.front()];
      knownIndex = knownIndex == kNoShape ? next : knownIndex;
      index = knownIndex;
    } else {
      index = indexOfMeshes.try_emplace(object.meshes, next).first->second;
    }
    if (index == next) meshesOfShape_.push_back(object.meshes);
    shapeIndexOfObject_.push_back(index);
  }
}

void Scene::computeHashAndBoxes(const std::vector<bool>& isBodyObject) {
  std::vector<std::vector<Eigen::Vector3f>> positions;
  for (const auto& meshes : meshesOfShape_)
    positions.push_back(collectSolidPositions(model_, meshes));
  std::vector<Aabb> boxes(model_.objects.size());  // empty: without area
  std::vector<char> isStatic(boxes.size());        // bytes, because two threads write them
  std::atomic<std::size_t> next = 0;
  const auto computeBoxes = [&] {
    constexpr std::size_t kStep = 4096;
    for (std::size_t begin = next.fetch_add(kStep); begin < boxes.size();
         begin = next.fetch_add(kStep)) {
      for (std::size_t i = begin; i < std::min(begin + kStep, boxes.size()); ++i) {
        const Eigen::Affine3d& placed = model_.objects[i].worldFromMesh;
        isStatic[i] = !isBodyObject[i] && model_.objects[i].usage != Object::Usage::visualOnly;
        if (!preservesArea(placed)) continue;
        for (const Eigen::Vector3f& p : positions[shapeIndexOfObject_[i]])
          boxes[i].include(placed * p.cast<double>());
      }
    }
  };
  auto helper = std::async(std::launch::async | std::launch::deferred, [&] {
    hash_ = hashModel(model_);
    computeBoxes();
  });
  computeBoxes();
  helper.get();
  for (std::uint32_t i = 0; i < boxes.size(); ++i) {
    if (boxes[i].empty()) continue;
    bounds_.include(boxes[i]);
    if (!isStatic[i]) continue;
    solidObjects_.push_back(i);
    staticBoxes_.push_back(boxes[i]);
  }
}

const Shape& Scene::shape(std::uint32_t object) const {
  requireObject(model_, object);
  const std::uint32_t index = shapeIndexOfObject_[object];
  return shapes_->get(index, [&] { return buildShape(model_.meshes, meshesOfShape_[index]); });
}

const CollisionGeometry& Scene::collisionGeometry(std::uint32_t object) const {
  requireObject(model_, object);
  return collisionGeometries_->get(object, [&] {
    const Eigen::Affine3d& placed = model_.objects[object].worldFromMesh;
    return preservesArea(placed) ? buildCollisionGeometry(shape(object), placed)
                                 : CollisionGeometry();
  });
}

void Scene::prefetchCollisionGeometry(std::span<const std::uint32_t> objects) const {
  std::vector<std::uint32_t> missing;
  for (const std::uint32_t object : objects)
    if (!collisionGeometries_->has(object)) missing.push_back(object);
  if (!missing.empty()) prefetcher_->add(missing);
}

const ObjectClasses& Scene::objectClasses() const {
  std::call_once(classesBuilt_, [this] { classes_ = computeObjectClasses(model_); });
  return classes_;
}

const std::vector<Aabb>& Scene::objectBoxes() const {
  std::call_once(boxesBuilt_, [this] {
    objectBoxes_.resize(model_.objects.size());
    for (std::size_t i = 0; i < objectBoxes_.size(); ++i)
      objectBoxes_[i] = computeWorldAabb(model_, model_.objects[i]);
  });
  return objectBoxes_;
}

const std::vector<CoplanarRank>& Scene::coplanarRanks() const {
  std::call_once(ranksBuilt_, [this] { coplanarRanks_ = rankCoplanarObjects(model_); });
  return coplanarRanks_;
}

const std::vector<DrawItem>& Scene::drawItems() const {
  std::call_once(itemsBuilt_, [this] { drawItems_ = buildDrawItems(model_, coplanarRanks()); });
  return drawItems_;
}

SceneTrees& Scene::trees(const std::function<std::shared_ptr<SceneTrees>()>& make) const {
  std::call_once(treesMade_, [&] { trees_ = make(); });
  return *trees_;
}

Scene::Memory Scene::memory() const {
  Memory memory;
  memory.geometry = shapes_->bytes();
  memory.parts = collisionGeometries_->bytes();
  memory.perObject =
      staticBoxes_.capacity() * sizeof(Aabb) +
      (solidObjects_.capacity() + shapeIndexOfObject_.capacity()) * sizeof(std::uint32_t) +
      (shapes_->size + collisionGeometries_->size) * sizeof(void*);
  for (const auto& meshes : meshesOfShape_) {
    memory.perObject += sizeof meshes + meshes.capacity() * sizeof(std::uint32_t);
  }
  return memory;
}

}  // namespace enfilade::scene
