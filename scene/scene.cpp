#include "scene/scene.hpp"

#include <mutex>
#include <stdexcept>

#include "scene/hasher.hpp"

namespace enfilade::scene {

struct Scene::Lazy {
  std::once_flag once;
  collision::TriangleTree tree;
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
    for (const double number :
         {body.low, body.high, body.speed, body.acceleration, body.closesAfter.value_or(-1),
          body.density, body.mass.value_or(-1), body.friction, body.restitution})
      hash.add(number);
    for (const double stop : body.stops) hash.add(stop);
    hash.add(static_cast<std::uint64_t>(body.openedBy));
    hash.add((std::uint64_t{body.loops} << 1) | std::uint64_t{body.runs});
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
  }
  addBodies(hash, model.bodies);
  return hash.value();
}

bool hasArea(const collision::Triangle& t) {
  // Equal corners are asked for by themselves: their cross product is zero only up to overflow.
  if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) return false;
  return !(t[1] - t[0]).cross(t[2] - t[0]).isZero(0.0);
}

/// Calls `take` with every triangle of the object that has an area, in the order of the model.
template <class Take>
void forEachSolidTriangle(const Model& model, const Object& object, const Take& take) {
  std::vector<Vec3> world;
  for (const std::uint32_t meshIndex : object.meshes) {
    const Mesh& mesh = model.meshes[meshIndex];
    world.resize(mesh.positions.size());
    for (std::uint32_t v = 0; v < world.size(); ++v) world[v] = worldPosition(object, mesh, v);
    for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
      const collision::Triangle triangle{world[mesh.indices[i]], world[mesh.indices[i + 1]],
                                         world[mesh.indices[i + 2]]};
      if (hasArea(triangle)) take(triangle);
    }
  }
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
  for (const BodySpec& body : model_.bodies) {
    for (const std::uint32_t object : body.objects) moves[object] = true;
    shapes_.push_back(std::make_shared<const BodyShape>(shapeOf(model_, body)));
  }
  for (std::uint32_t i = 0; i < model_.objects.size(); ++i) {
    Box box;
    forEachSolidTriangle(model_, model_.objects[i], [&](const collision::Triangle& triangle) {
      for (const Vec3& corner : triangle) box.include(corner);
    });
    if (box.empty()) continue;
    bounds_.include(box);
    if (moves[i]) continue;
    solidObjects_.push_back(i);
    stillBoxes_.push_back(box);
  }
  hash_ = hashOf(model_);
  lazy_ = std::make_unique<Lazy[]>(model_.objects.size());
}

Scene::~Scene() = default;

const collision::TriangleTree& Scene::triangles(std::uint32_t object) const {
  if (object >= model_.objects.size()) {
    throw std::out_of_range("object " + std::to_string(object) + " of " +
                            std::to_string(model_.objects.size()));
  }
  Lazy& lazy = lazy_[object];
  std::call_once(lazy.once, [&] {
    const std::vector<collision::Triangle> triangles = solidTriangles(model_, object);
    if (!triangles.empty()) lazy.tree = collision::TriangleTree(triangles);
  });
  return lazy.tree;
}

std::vector<collision::Triangle> solidTriangles(const Model& model, std::uint32_t object) {
  std::vector<collision::Triangle> triangles;
  forEachSolidTriangle(model, model.objects[object],
                       [&](const collision::Triangle& t) { triangles.push_back(t); });
  return triangles;
}

}  // namespace enfilade::scene
