#include "scene/world/data/scene.hpp"

#include <array>
#include <atomic>
#include <map>
#include <stdexcept>

#include "scene/model/hasher.hpp"

namespace enfilade::scene {

/// Things that are made when first asked for. Two threads that ask at once may both make one; the
/// first to be done is kept, and both get it.
template <class T>
struct Scene::Lazy {
  explicit Lazy(std::size_t count) : things(new std::atomic<const T*>[count]()), size(count) {}
  ~Lazy() {
    for (std::size_t i = 0; i < size; ++i) delete things[i].load();
  }
  Lazy(const Lazy&) = delete;
  Lazy& operator=(const Lazy&) = delete;

  template <class Make>
  const T& get(std::size_t i, const Make& make) {
    if (const T* made = things[i].load(std::memory_order_acquire)) return *made;
    auto own = std::make_unique<const T>(make());
    const T* first = nullptr;
    if (things[i].compare_exchange_strong(first, own.get())) return *own.release();
    return *first;
  }
  std::size_t bytes() const {
    std::size_t sum = 0;
    for (std::size_t i = 0; i < size; ++i) {
      if (const T* made = things[i].load()) sum += sizeof *made + made->bytes();
    }
    return sum;
  }

  std::unique_ptr<std::atomic<const T*>[]> things;
  std::size_t size;
};

namespace {

std::uint64_t hashOf(const Mesh& mesh) {
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

/// Nothing for a scene without bodies.
void addBodies(Hasher& hash, const std::vector<BodySpec>& bodies) {
  for (const BodySpec& body : bodies) {
    hash.add(std::string_view(body.name));
    hash.add(static_cast<std::uint64_t>(body.kind));
    for (const std::uint32_t object : body.objects) hash.add(std::uint64_t{object});
    hash.add(body.anchor);
    hash.add(body.axis);
    for (const double number : {body.low, body.high, body.closed, body.speed, body.acceleration,
                                body.closesAfter.value_or(-1), body.density, body.mass.value_or(-1),
                                body.friction, body.restitution})
      hash.add(number);
    for (const double stop : body.stops) hash.add(stop);
    hash.add(static_cast<std::uint64_t>(body.openedBy));
    hash.add((std::uint64_t{body.loops} << 1) | std::uint64_t{body.runs});
    if (!body.velocity.isZero(0) || !body.spin.isZero(0)) {
      hash.add(body.velocity);
      hash.add(body.spin);
    }
    for (const PathKey& key : body.keys) {
      hash.add(key.time);
      hash.add(key.offset);
      hash.add(key.turn);
    }
  }
}

/// Meshes are hashed once and placed often, so that a scene of many copies stays cheap.
std::uint64_t hashOf(const Model& model) {
  std::vector<std::uint64_t> meshHashes;
  for (const Mesh& mesh : model.meshes) meshHashes.push_back(hashOf(mesh));
  Hasher hash;
  hash.add(std::uint64_t{model.objects.size()});
  for (const Object& object : model.objects) {
    hash.add(std::string_view(object.path));
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 4; ++column) hash.add(object.worldFromMesh(row, column));
    }
    hash.add(std::uint64_t{object.meshes.size()});
    for (const std::uint32_t mesh : object.meshes) hash.add(meshHashes[mesh]);
    if (object.use != Object::Use::whole) hash.add(static_cast<std::uint64_t>(object.use));
  }
  addBodies(hash, model.bodies);
  return hash.value();
}

/// The positions that triangles with an area use, each once.
std::vector<Eigen::Vector3f> solidPositions(const Model& model,
                                            const std::vector<std::uint32_t>& meshes) {
  std::vector<Eigen::Vector3f> positions;
  std::vector<bool> used;
  for (const std::uint32_t index : meshes) {
    const Mesh& mesh = model.meshes[index];
    used.assign(mesh.positions.size(), false);
    for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
      const std::array<std::uint32_t, 3> t{mesh.indices[i], mesh.indices[i + 1],
                                           mesh.indices[i + 2]};
      if (!hasArea(mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]])) continue;
      for (const std::uint32_t corner : t) {
        if (!used[corner]) positions.push_back(mesh.positions[corner]);
        used[corner] = true;
      }
    }
  }
  return positions;
}

/// A placement that maps all of space onto a line leaves no area.
bool keepsArea(const Eigen::Affine3d& placed) {
  const auto& m = placed.linear();
  return !(m.col(0).cross(m.col(1)).isZero(0.0) && m.col(1).cross(m.col(2)).isZero(0.0) &&
           m.col(2).cross(m.col(0)).isZero(0.0));
}

constexpr std::uint32_t kNone = 0xffffffff;

void requireObject(const Model& model, std::uint32_t object) {
  if (object < model.objects.size()) return;
  throw std::out_of_range("object " + std::to_string(object) + " of " +
                          std::to_string(model.objects.size()));
}

void requireValidIndices(const Model& model) {
  for (const Mesh& mesh : model.meshes) {
    for (const std::uint32_t index : mesh.indices) {
      if (index >= mesh.positions.size()) {
        throw std::invalid_argument("mesh '" + mesh.name + "': index " + std::to_string(index) +
                                    " but only " + std::to_string(mesh.positions.size()) +
                                    " positions");
      }
    }
  }
  for (const Object& object : model.objects) {
    for (const std::uint32_t mesh : object.meshes) {
      if (mesh >= model.meshes.size()) {
        throw std::invalid_argument("object '" + object.path + "': no mesh " +
                                    std::to_string(mesh));
      }
    }
  }
}

}  // namespace

Scene::Scene(Model model) : model_(std::move(model)) {
  requireValidIndices(model_);
  if (const auto why = refusalOfBodies(model_)) throw std::invalid_argument(*why);
  std::vector<bool> moves(model_.objects.size());
  ShapesOfMeshes shapesOfMeshes;
  for (const BodySpec& body : model_.bodies) {
    for (const std::uint32_t object : body.objects) moves[object] = true;
    bodyShapes_.push_back(std::make_shared<const BodyShape>(shapeOf(model_, body, shapesOfMeshes)));
  }
  numberShapes();
  boxObjects(moves);
  hash_ = hashOf(model_);
  shapes_ = std::make_unique<Lazy<Shape>>(meshesOfShape_.size());
  parts_ = std::make_unique<Lazy<ObjectParts>>(model_.objects.size());
}

Scene::~Scene() = default;

void Scene::numberShapes() {
  std::map<std::vector<std::uint32_t>, std::uint32_t> numbers;
  std::vector<std::uint32_t> numberOfMesh(model_.meshes.size(), kNone);  // of objects of one mesh
  shapeOfObject_.reserve(model_.objects.size());
  for (const Object& object : model_.objects) {
    const auto next = static_cast<std::uint32_t>(meshesOfShape_.size());
    std::uint32_t number = next;
    if (object.meshes.size() == 1) {
      std::uint32_t& known = numberOfMesh[object.meshes.front()];
      known = known == kNone ? next : known;
      number = known;
    } else {
      number = numbers.try_emplace(object.meshes, next).first->second;
    }
    if (number == next) meshesOfShape_.push_back(object.meshes);
    shapeOfObject_.push_back(number);
  }
}

void Scene::boxObjects(const std::vector<bool>& moves) {
  std::vector<std::vector<Eigen::Vector3f>> positions;
  for (const auto& meshes : meshesOfShape_) positions.push_back(solidPositions(model_, meshes));
  for (std::uint32_t i = 0; i < model_.objects.size(); ++i) {
    const Eigen::Affine3d& placed = model_.objects[i].worldFromMesh;
    const auto& own = positions[shapeOfObject_[i]];
    if (own.empty() || !keepsArea(placed)) continue;
    Box box;
    for (const Eigen::Vector3f& p : own) box.include(placed * p.cast<double>());
    bounds_.include(box);
    if (moves[i] || model_.objects[i].use == Object::Use::drawn) continue;
    solidObjects_.push_back(i);
    stillBoxes_.push_back(box);
  }
}

const Shape& Scene::shape(std::uint32_t object) const {
  requireObject(model_, object);
  const std::uint32_t number = shapeOfObject_[object];
  return shapes_->get(number, [&] { return shapeOf(model_.meshes, meshesOfShape_[number]); });
}

const ObjectParts& Scene::parts(std::uint32_t object) const {
  requireObject(model_, object);
  return parts_->get(object, [&] {
    const Eigen::Affine3d& placed = model_.objects[object].worldFromMesh;
    return keepsArea(placed) ? partsOf(shape(object), placed) : ObjectParts();
  });
}

Scene::Memory Scene::memory() const {
  Memory memory;
  memory.geometry = shapes_->bytes();
  memory.parts = parts_->bytes();
  memory.perObject =
      stillBoxes_.capacity() * sizeof(Box) +
      (solidObjects_.capacity() + shapeOfObject_.capacity()) * sizeof(std::uint32_t) +
      (shapes_->size + parts_->size) * sizeof(void*);
  for (const auto& meshes : meshesOfShape_) {
    memory.perObject += sizeof meshes + meshes.capacity() * sizeof(std::uint32_t);
  }
  return memory;
}

std::vector<collision::Triangle> solidTriangles(const Model& model, std::uint32_t object) {
  std::vector<collision::Triangle> triangles;
  const Object& placed = model.objects[object];
  std::vector<Vec3> world;
  for (const std::uint32_t meshIndex : placed.meshes) {
    const Mesh& mesh = model.meshes[meshIndex];
    world.resize(mesh.positions.size());
    for (std::uint32_t v = 0; v < world.size(); ++v) world[v] = worldPosition(placed, mesh, v);
    for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
      const collision::Triangle t{world[mesh.indices[i]], world[mesh.indices[i + 1]],
                                  world[mesh.indices[i + 2]]};
      if (hasArea(t)) triangles.push_back(t);
    }
  }
  return triangles;
}

}  // namespace enfilade::scene
