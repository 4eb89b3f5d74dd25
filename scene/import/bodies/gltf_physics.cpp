// KHR_physics_rigid_bodies (draft of 2024) as far as a walk has bodies for it: motion with its mass
// and velocity, colliders with their shapes and materials, triggers, and joints that leave one
// degree of freedom between a body and what stands. The rest is told, not guessed.
#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "scene/import/bodies/body_precedence.hpp"
#include "scene/import/bodies/gltf_bodies.hpp"

namespace enfilade::scene {
namespace {

using Json = nlohmann::json;

constexpr double kAligned = 1e-4;                // of a joint's frames: cosines, and metres aside
constexpr double kLocked = 1e-6;                 // metres, radians: a limit that leaves no room
constexpr double kHalfTurn = 3.141592653589793;  // radians: what a hinge without limits gets
constexpr const char* kExtension = "KHR_physics_rigid_bodies";

/// The member, or null.
const Json* member(const Json* json, const char* key) {
  if (json == nullptr || !json->is_object()) return nullptr;
  const auto found = json->find(key);
  return found == json->end() ? nullptr : &*found;
}

const Json* entry(const Json* list, std::optional<std::size_t> index) {
  const bool there = list != nullptr && list->is_array() && index && *index < list->size();
  return there ? &(*list)[*index] : nullptr;
}

std::optional<std::size_t> indexIn(const Json* json, const char* key) {
  const Json* value = member(json, key);
  if (value == nullptr || !value->is_number_unsigned()) return std::nullopt;
  return value->get<std::size_t>();
}

std::optional<double> numberIn(const Json* json, const char* key) {
  const Json* value = member(json, key);
  if (value == nullptr || !value->is_number()) return std::nullopt;
  const double number = value->get<double>();
  return std::isfinite(number) ? std::optional(number) : std::nullopt;
}

std::optional<Vec3> vectorIn(const Json* json, const char* key) {
  const Json* value = member(json, key);
  if (value == nullptr || !value->is_array() || value->size() != 3) return std::nullopt;
  Vec3 result;
  for (int i = 0; i < 3; ++i) {
    const Json& number = (*value)[static_cast<std::size_t>(i)];
    if (!number.is_number()) return std::nullopt;
    result[i] = number.get<double>();
  }
  return result.allFinite() ? std::optional(result) : std::nullopt;
}

bool isTrue(const Json* json, const char* key) {
  const Json* value = member(json, key);
  return value != nullptr && value->is_boolean() && value->get<bool>();
}

// ---- joints -------------------------------------------------------------------------------------

/// One of a joint's six ways to give.
struct Freedom {
  bool locked = false;
  std::optional<double> min, max;
};

struct Freedoms {
  std::array<Freedom, 3> linear, angular;
  std::string unread;  ///< what of the limits cannot be had
};

void limit(Freedoms& freedoms, const Json& one, const char* key, std::array<Freedom, 3>& ways) {
  const Json* axes = member(&one, key);
  if (axes == nullptr || !axes->is_array()) return;
  const std::optional<double> min = numberIn(&one, "min"), max = numberIn(&one, "max");
  // Of several axes the limit is on a distance, or on the angle of a cone.
  const bool locked = max && *max <= kLocked && (axes->size() > 1 || (min && *min >= -kLocked));
  for (const Json& axis : *axes) {
    if (!axis.is_number_unsigned() || axis.get<std::size_t>() > 2) continue;
    Freedom& way = ways[axis.get<std::size_t>()];
    way.locked = way.locked || locked;
    if (locked) continue;
    if (axes->size() > 1) freedoms.unread = "a limit over several axes that leaves room";
    way.min = min;
    way.max = max;
  }
}

Freedoms freedomsOf(const Json& joint) {
  Freedoms freedoms;
  const Json* limits = member(&joint, "limits");
  if (limits == nullptr || !limits->is_array()) return freedoms;
  for (const Json& one : *limits) {
    limit(freedoms, one, "linearAxes", freedoms.linear);
    limit(freedoms, one, "angularAxes", freedoms.angular);
  }
  return freedoms;
}

/// The only axis that is free; nullopt when there is none or more.
std::optional<std::size_t> onlyFree(const std::array<Freedom, 3>& ways) {
  std::optional<std::size_t> found;
  for (std::size_t i = 0; i < ways.size(); ++i) {
    if (ways[i].locked) continue;
    if (found) return std::nullopt;
    found = i;
  }
  return found;
}

bool allLocked(const std::array<Freedom, 3>& ways) {
  return std::all_of(ways.begin(), ways.end(), [](const Freedom& way) { return way.locked; });
}

/// Axes as columns, each of unit length.
Eigen::Matrix3d axesOf(const Eigen::Affine3d& frame) {
  Eigen::Matrix3d axes = frame.linear();
  for (int i = 0; i < 3; ++i) axes.col(i).normalize();
  return axes;
}

// ---- the whole ----------------------------------------------------------------------------------

/// What colliders say of the body that they belong to.
struct Matter {
  std::set<std::uint32_t> colliders;  ///< objects
  std::optional<double> friction, restitution;
};

class PhysicsReader {
 public:
  explicit PhysicsReader(GltfTree& tree) : tree_(tree), model_(tree.model()) {
    document_ = member(member(&tree.file(), "extensions"), kExtension);
    for (const auto& [number, place] : tree.places()) {
      const Json* physics = member(member(&tree.node(number), "extensions"), kExtension);
      if (physics == nullptr) continue;
      physics_[number] = physics;
      if (member(physics, "motion") != nullptr) motions_.insert(number);
    }
    owned_ = tree.objectsByOwner(motions_);
    for (const Object& object : model_.objects) paths_.insert(object.path);
  }

  std::vector<BodySpec> read() {
    for (const auto& [number, physics] : physics_) {
      if (const Json* collider = member(physics, "collider")) readCollider(number, *collider);
      if (const Json* trigger = member(physics, "trigger")) readTrigger(number, *trigger);
    }
    for (const std::size_t number : motions_) readMotion(number);
    for (const auto& [number, physics] : physics_)
      if (const Json* joint = member(physics, "joint")) readJoint(number, *joint);
    for (auto& [number, body] : moving_) {
      if (stands_.contains(number)) {
        tell(number, "kinematic, or of infinite mass, without a joint: it stands still");
      } else {
        bodies_.push_back(std::move(body));
      }
    }
    dropSenseless();
    return std::move(bodies_);
  }

 private:
  const std::string& pathOf(std::size_t number) const { return tree_.places().at(number).path; }
  void tell(std::size_t number, const std::string& what) {
    addProblem(model_, "unsupported_physics", "node '" + pathOf(number) + "': " + what);
  }
  void tellIfThere(std::size_t number, const Json* json, std::initializer_list<const char*> keys) {
    for (const char* key : keys)
      if (member(json, key) != nullptr) tell(number, std::string(key) + " is left out");
  }

  /// A file that other programs wrote must not keep the scene from loading.
  void dropSenseless() {
    std::erase_if(bodies_, [&](const BodySpec& body) {
      const auto why = refusalOfBody(body);
      if (why) addProblem(model_, "unsupported_physics", "body '" + body.name + "': " + *why);
      return why.has_value();
    });
  }

  // ---- shapes ----

  std::uint32_t addShape(std::size_t number, const char* name, std::vector<std::uint32_t> meshes,
                         const Eigen::Affine3d& worldFromMesh) {
    Object object;
    object.path = pathOf(number) + name;
    for (int repeat = 2; !paths_.insert(object.path).second; ++repeat)
      object.path = pathOf(number) + name + "#" + std::to_string(repeat);
    object.meshes = std::move(meshes);
    object.worldFromMesh = worldFromMesh;
    object.use = Object::Use::solid;
    model_.objects.push_back(std::move(object));
    return static_cast<std::uint32_t>(model_.objects.size() - 1);
  }

  /// What a geometry stands for: the node's own object, or a new one that is only solid.
  std::optional<std::uint32_t> geometryObject(std::size_t number, const Json& of,
                                              const char* name) {
    const Json* told = member(&of, "geometry");
    const Json* geometry = told != nullptr ? told : &of;  // drafts before 2024 had it right here
    const auto own = tree_.objectOf(number);
    if (const auto shape = indexIn(geometry, "shape")) {
      const Json* shapes =
          member(member(member(&tree_.file(), "extensions"), "KHR_implicit_shapes"), "shapes");
      const Json* one = entry(shapes, shape);
      std::optional<Mesh> mesh = one == nullptr ? std::nullopt : implicitShape(*one);
      if (!mesh) {
        tell(number, "shape " + std::to_string(*shape) + " is missing, unknown or senseless");
        return std::nullopt;
      }
      mesh->name = pathOf(number);
      model_.meshes.push_back(std::move(*mesh));
      const auto index = static_cast<std::uint32_t>(model_.meshes.size() - 1);
      return addShape(number, name, {index}, tree_.worldFromNode(number));
    }
    const auto node = indexIn(geometry, "node");
    if (!node || *node == number) {
      if (!own) tell(number, std::string(name + 1) + " without a shape, on a node without a mesh");
      return own;
    }
    const auto other = tree_.objectOf(*node);
    if (!other) {
      tell(number, "its geometry is a node without a mesh, or outside of the scene");
      return std::nullopt;
    }
    const Object& drawn = model_.objects[*other];
    const Eigen::Affine3d placed = tree_.worldFromNode(number) *
                                   tree_.worldFromNode(*node).inverse(Eigen::Affine) *
                                   drawn.worldFromMesh;
    return addShape(number, name, std::vector(drawn.meshes), placed);
  }

  void readCollider(std::size_t number, const Json& collider) {
    tellIfThere(number, &collider, {"collisionFilter"});
    const auto object = geometryObject(number, collider, "/collider");
    if (!object) return;
    const auto own = tree_.objectOf(number);
    const auto owner = tree_.ownerOf(number, motions_);
    if (own && *own != *object) model_.objects[*own].use = Object::Use::drawn;
    std::optional<std::uint32_t> whole = own;
    if (owner) {
      std::vector<std::uint32_t>& objects = owned_[*owner];
      if (!whole && !objects.empty()) whole = objects.front();
      if (!whole) objects.push_back(*object);  // a body that nobody sees
      Matter& matter = matter_[*owner];
      matter.colliders.insert(*object);
      readMaterial(number, collider, matter);
    }
    if (whole && *whole != *object) model_.objects[*object].pieceOf = *whole;
  }

  void readMaterial(std::size_t number, const Json& collider, Matter& matter) {
    const auto index = indexIn(&collider, "physicsMaterial");
    if (!index) return;
    const Json* material = entry(member(document_, "physicsMaterials"), index);
    if (material == nullptr) return tell(number, "there is no such physicsMaterial");
    tellIfThere(number, material, {"frictionCombine", "restitutionCombine"});
    // One coefficient for both: what slides shows it.
    const auto sliding = numberIn(material, "dynamicFriction");
    matter.friction = sliding ? sliding : numberIn(material, "staticFriction");
    matter.restitution = numberIn(material, "restitution");
  }

  void readTrigger(std::size_t number, const Json& trigger) {
    tellIfThere(number, &trigger, {"collisionFilter", "nodes"});
    if (member(&trigger, "nodes") != nullptr) return;
    if (tree_.ownerOf(number, motions_)) return tell(number, "a trigger that moves is left out");
    const auto object = geometryObject(number, trigger, "/trigger");
    if (!object) return;
    const auto own = tree_.objectOf(number);
    if (own && *own != *object) model_.objects[*own].use = Object::Use::drawn;
    BodySpec body;
    body.kind = BodyKind::trigger;
    body.source = BodySource::khr;
    body.name = pathOf(number);
    body.objects = {*object};
    bodies_.push_back(std::move(body));
  }

  // ---- bodies ----

  void readMotion(std::size_t number) {
    const Json* motion = member(physics_.at(number), "motion");
    const auto objects = owned_.find(number);
    if (objects == owned_.end()) return tell(number, "motion of a node without any mesh");
    tellIfThere(number, motion, {"centerOfMass", "inertiaDiagonal", "inertiaOrientation"});
    if (numberIn(motion, "gravityFactor").value_or(1) != 1) tell(number, "gravityFactor is 1");
    BodySpec body;
    body.source = BodySource::khr;
    body.name = pathOf(number);
    body.objects = objects->second;
    body.mass = numberIn(motion, "mass");
    const Eigen::Matrix3d axes = axesOf(tree_.worldFromNode(number));
    body.velocity = axes * vectorIn(motion, "linearVelocity").value_or(Vec3::Zero());
    body.spin = axes * vectorIn(motion, "angularVelocity").value_or(Vec3::Zero());
    takeMatter(number, body);
    if (isTrue(motion, "isKinematic") || body.mass == 0.0) {
      body.mass.reset();
      stands_.insert(number);  // unless a joint says how it moves
    }
    moving_.emplace(number, std::move(body));
  }

  void takeMatter(std::size_t number, BodySpec& body) {
    const auto matter = matter_.find(number);
    if (matter == matter_.end()) return;  // its meshes are what it is
    body.friction = matter->second.friction.value_or(body.friction);
    body.restitution = matter->second.restitution.value_or(body.restitution);
    for (const std::uint32_t object : body.objects) {
      Object& part = model_.objects[object];
      const bool collides = matter->second.colliders.contains(object);
      if (!collides && part.use == Object::Use::whole) part.use = Object::Use::drawn;
    }
  }

  // ---- joints ----

  void readJoint(std::size_t number, const Json& joint) {
    const Json* description = entry(member(document_, "physicsJoints"), indexIn(&joint, "joint"));
    const auto connected = indexIn(&joint, "connectedNode");
    if (description == nullptr || !connected || !tree_.places().contains(*connected))
      return tell(number, "its joint or the node that it connects is missing");
    const auto here = tree_.ownerOf(number, motions_), there = tree_.ownerOf(*connected, motions_);
    if (here.has_value() == there.has_value())
      return tell(number, here ? "a joint of two bodies is left out: both are free"
                               : "a joint of nothing that moves");
    const std::size_t body = here ? *here : *there;
    const auto found = moving_.find(body);
    if (found == moving_.end()) return;  // told before
    tellIfThere(number, description, {"drives"});
    if (const Json* limits = member(description, "limits"); limits && limits->is_array())
      for (const Json& one : *limits) tellIfThere(number, &one, {"stiffness", "damping"});
    const std::string why =
        applyJoint(number, *connected, *description, here.has_value(), found->second);
    if (!why.empty()) return tell(number, "its joint is left out: " + why);
    if (!jointed_.insert(body).second) tell(number, "a second joint replaces the first");
    stands_.erase(body);
  }

  /// Says why not. The joint's coordinate is that of the connected node in the node's frame.
  std::string applyJoint(std::size_t number, std::size_t connected, const Json& description,
                         bool nodeMoves, BodySpec& body) {
    const Freedoms freedoms = freedomsOf(description);
    if (!freedoms.unread.empty()) return freedoms.unread;
    const Eigen::Affine3d node = tree_.worldFromNode(number),
                          other = tree_.worldFromNode(connected);
    const Eigen::Matrix3d axes = axesOf(node);
    if ((axes.transpose() * axesOf(other)).diagonal().minCoeff() < 1 - kAligned)
      return "its two frames are turned against one another";
    const auto hinge = onlyFree(freedoms.angular), slide = onlyFree(freedoms.linear);
    const bool turns = hinge && allLocked(freedoms.linear);
    const bool slides = slide && allLocked(freedoms.angular);
    if (!turns && !slides) return "it leaves more or less than one way to move";
    const std::size_t axis = turns ? *hinge : *slide;
    const Freedom& way = turns ? freedoms.angular[axis] : freedoms.linear[axis];
    const Vec3 along = axes.col(static_cast<Eigen::Index>(axis));
    const Vec3 apart = other.translation() - node.translation();
    const double now = slides ? apart.dot(along) : 0;
    if ((apart - now * along).norm() > kAligned) return "its two frames lie apart";
    if (slides && (!way.min || !way.max)) return "a slider needs both its limits";
    const double low = way.min.value_or(-kHalfTurn) - now;
    const double high = way.max.value_or(kHalfTurn) - now;
    if (!(low <= 0 && high >= 0 && low < high)) return "it begins outside of its limits";
    body.kind = turns ? BodyKind::hinged : BodyKind::sliding;
    body.openedBy = OpenedBy::touch;
    body.anchor = node.translation();
    body.axis = along;
    body.low = nodeMoves ? -high : low;
    body.high = nodeMoves ? -low : high;
    body.speed = turns ? kHalfTurn / 2 : 1;
    body.velocity = body.spin = Vec3::Zero();
    return {};
  }

  GltfTree& tree_;
  Model& model_;
  const Json* document_ = nullptr;
  std::map<std::size_t, const Json*> physics_;  // by node
  std::set<std::size_t> motions_, stands_, jointed_;
  OwnedObjects owned_;
  std::map<std::size_t, Matter> matter_;    // by the node with the motion
  std::map<std::size_t, BodySpec> moving_;  // by the node with the motion
  std::vector<BodySpec> bodies_;
  std::set<std::string> paths_;
};

}  // namespace

std::vector<BodySpec> physicsBodies(GltfTree& tree) {
  return PhysicsReader(tree).read();
}

}  // namespace enfilade::scene
