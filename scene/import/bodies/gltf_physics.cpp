#include "scene/import/bodies/gltf_physics.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "scene/import/bodies/implicit_shapes.hpp"
#include "scene/import/gltf/encoding/gltf_json.hpp"
#include "scene/model/add_diagnostic.hpp"

namespace enfilade::scene {
namespace {

using Json = nlohmann::json;

constexpr double kAlignmentTolerance =
    1e-4;  // of a joint's frames: cosine error, and metres of offset
constexpr double kLockedTolerance = 1e-6;  // metres or radians: a smaller range counts as locked
constexpr double kHalfTurn = 3.141592653589793;  // radians: range of a hinge without limits
constexpr const char* kExtension = "KHR_physics_rigid_bodies";

const Json* findListEntry(const Json* list, std::optional<std::size_t> index) {
  const bool there = list != nullptr && list->is_array() && index && *index < list->size();
  return there ? &(*list)[*index] : nullptr;
}

std::optional<double> readNumberMember(const Json* json, const char* key) {
  const Json* value = findMember(json, key);
  if (value == nullptr || !value->is_number()) return std::nullopt;
  const double number = value->get<double>();
  return std::isfinite(number) ? std::optional(number) : std::nullopt;
}

std::optional<Vec3> readVectorMember(const Json* json, const char* key) {
  const Json* value = findMember(json, key);
  if (value == nullptr || !value->is_array() || value->size() != 3) return std::nullopt;
  Vec3 result;
  for (int i = 0; i < 3; ++i) {
    const Json& number = (*value)[static_cast<std::size_t>(i)];
    if (!number.is_number()) return std::nullopt;
    result[i] = number.get<double>();
  }
  return result.allFinite() ? std::optional(result) : std::nullopt;
}

bool readFlagMember(const Json* json, const char* key) {
  const Json* value = findMember(json, key);
  return value != nullptr && value->is_boolean() && value->get<bool>();
}

// ---- joints -------------------------------------------------------------------------------------

/// One of a joint's six degrees of freedom.
struct DegreeOfFreedom {
  bool locked = false;
  std::optional<double> min, max;
};

struct JointFreedoms {
  std::array<DegreeOfFreedom, 3> linear, angular;
  std::string unsupported;  ///< limits that are not supported
};

void readLimit(JointFreedoms& freedoms, const Json& one, const char* key,
               std::array<DegreeOfFreedom, 3>& axisFreedoms) {
  const Json* axes = findMember(&one, key);
  if (axes == nullptr || !axes->is_array()) return;
  const std::optional<double> min = readNumberMember(&one, "min"),
                              max = readNumberMember(&one, "max");
  // A limit over several axes bounds a distance or the angle of a cone.
  const bool locked =
      max && *max <= kLockedTolerance && (axes->size() > 1 || (min && *min >= -kLockedTolerance));
  for (const Json& axis : *axes) {
    if (!axis.is_number_unsigned() || axis.get<std::size_t>() > 2) continue;
    DegreeOfFreedom& freedom = axisFreedoms[axis.get<std::size_t>()];
    freedom.locked = freedom.locked || locked;
    if (locked) continue;
    if (axes->size() > 1) freedoms.unsupported = "a limit over several axes that leaves room";
    freedom.min = min;
    freedom.max = max;
  }
}

JointFreedoms readFreedoms(const Json& joint) {
  JointFreedoms freedoms;
  const Json* limits = findMember(&joint, "limits");
  if (limits == nullptr || !limits->is_array()) return freedoms;
  for (const Json& one : *limits) {
    readLimit(freedoms, one, "linearAxes", freedoms.linear);
    readLimit(freedoms, one, "angularAxes", freedoms.angular);
  }
  return freedoms;
}

/// Returns the only free axis; nullopt if there are none or several.
std::optional<std::size_t> findOnlyFreeAxis(const std::array<DegreeOfFreedom, 3>& freedoms) {
  std::optional<std::size_t> found;
  for (std::size_t i = 0; i < freedoms.size(); ++i) {
    if (freedoms[i].locked) continue;
    if (found) return std::nullopt;
    found = i;
  }
  return found;
}

bool areAllLocked(const std::array<DegreeOfFreedom, 3>& freedoms) {
  return std::all_of(freedoms.begin(), freedoms.end(),
                     [](const DegreeOfFreedom& freedom) { return freedom.locked; });
}

/// Returns the axes as unit columns.
Eigen::Matrix3d extractAxes(const Eigen::Affine3d& frame) {
  Eigen::Matrix3d axes = frame.linear();
  for (int i = 0; i < 3; ++i) axes.col(i).normalize();
  return axes;
}

// ---- the extension ------------------------------------------------------------------------------

/// Properties of a body that its colliders define.
struct ColliderProperties {
  std::set<std::uint32_t> colliders;  ///< objects
  std::optional<double> friction, restitution;
};

class PhysicsReader {
 public:
  explicit PhysicsReader(GltfTree& tree) : tree_(tree), model_(tree.model()) {
    document_ = findMember(findMember(&tree.file(), "extensions"), kExtension);
    for (const auto& [number, transform] : tree.transforms()) {
      const Json* physics = findMember(findMember(&tree.node(number), "extensions"), kExtension);
      if (physics == nullptr) continue;
      physics_[number] = physics;
      if (findMember(physics, "motion") != nullptr) motions_.insert(number);
    }
    owned_ = tree.groupObjectsByOwner(motions_);
    for (const Object& object : model_.objects) paths_.insert(object.path);
  }

  std::vector<BodySpec> read() {
    for (const auto& [number, physics] : physics_) {
      if (const Json* collider = findMember(physics, "collider")) readCollider(number, *collider);
      if (const Json* trigger = findMember(physics, "trigger")) readTrigger(number, *trigger);
    }
    for (const std::size_t number : motions_) readMotion(number);
    for (const auto& [number, physics] : physics_)
      if (const Json* joint = findMember(physics, "joint")) readJoint(number, *joint);
    for (auto& [number, body] : moving_) {
      if (staticNodes_.contains(number)) {
        reportUnsupported(number, "kinematic, or of infinite mass, without a joint: it is static");
      } else {
        bodies_.push_back(std::move(body));
      }
    }
    dropInvalidBodies();
    return std::move(bodies_);
  }

 private:
  const std::string& getPath(std::size_t number) const {
    return tree_.transforms().at(number).path;
  }
  void reportUnsupported(std::size_t number, const std::string& what) {
    addDiagnostic(model_.diagnostics, "unsupported_physics",
                  "node '" + getPath(number) + "': " + what);
  }
  void reportUnsupportedKeys(std::size_t number, const Json* json,
                             std::initializer_list<const char*> keys) {
    for (const char* key : keys)
      if (findMember(json, key) != nullptr)
        reportUnsupported(number, std::string(key) + " is ignored");
  }

  /// Drops invalid bodies and counts them. A file of another program must not prevent loading.
  void dropInvalidBodies() {
    std::erase_if(bodies_, [&](const BodySpec& body) {
      const auto reason = validateBody(body);
      if (reason)
        addDiagnostic(model_.diagnostics, "unsupported_physics",
                      "body '" + body.name + "': " + *reason);
      return reason.has_value();
    });
  }

  // ---- shapes ----

  std::uint32_t addShape(std::size_t number, const char* name, std::vector<std::uint32_t> meshes,
                         const Eigen::Affine3d& worldFromMesh) {
    Object object;
    object.path = getPath(number) + name;
    for (int repeat = 2; !paths_.insert(object.path).second; ++repeat)
      object.path = getPath(number) + name + "#" + std::to_string(repeat);
    object.meshes = std::move(meshes);
    object.worldFromMesh = worldFromMesh;
    object.usage = Object::Usage::collisionOnly;
    model_.objects.push_back(std::move(object));
    return static_cast<std::uint32_t>(model_.objects.size() - 1);
  }

  /// Returns the object of a geometry: the node's own, or a new one that is only collision
  /// geometry.
  std::optional<std::uint32_t> makeGeometryObject(std::size_t number, const Json& of,
                                                  const char* name) {
    const Json* explicitGeometry = findMember(&of, "geometry");
    const Json* geometry =
        explicitGeometry != nullptr ? explicitGeometry : &of;  // drafts before 2024 had it here
    const auto own = tree_.findObject(number);
    if (const auto shape = readIndexMember(geometry, "shape")) {
      const Json* shapes = findMember(
          findMember(findMember(&tree_.file(), "extensions"), "KHR_implicit_shapes"), "shapes");
      const Json* one = findListEntry(shapes, shape);
      std::optional<Mesh> mesh = one == nullptr ? std::nullopt : makeImplicitShape(*one);
      if (!mesh) {
        reportUnsupported(number,
                          "shape " + std::to_string(*shape) + " is missing, unknown or invalid");
        return std::nullopt;
      }
      mesh->name = getPath(number);
      model_.meshes.push_back(std::move(*mesh));
      const auto index = static_cast<std::uint32_t>(model_.meshes.size() - 1);
      return addShape(number, name, {index}, tree_.worldFromNode(number));
    }
    const auto node = readIndexMember(geometry, "node");
    if (!node || *node == number) {
      if (!own)
        reportUnsupported(number,
                          std::string(name + 1) + " without a shape, on a node without a mesh");
      return own;
    }
    const auto other = tree_.findObject(*node);
    if (!other) {
      reportUnsupported(number, "its geometry is a node without a mesh, or outside of the scene");
      return std::nullopt;
    }
    const Object& drawn = model_.objects[*other];
    const Eigen::Affine3d placed = tree_.worldFromNode(number) *
                                   tree_.worldFromNode(*node).inverse(Eigen::Affine) *
                                   drawn.worldFromMesh;
    return addShape(number, name, std::vector(drawn.meshes), placed);
  }

  void readCollider(std::size_t number, const Json& collider) {
    reportUnsupportedKeys(number, &collider, {"collisionFilter"});
    const auto object = makeGeometryObject(number, collider, "/collider");
    if (!object) return;
    const auto own = tree_.findObject(number);
    const auto owner = tree_.findOwner(number, motions_);
    if (own && *own != *object) model_.objects[*own].usage = Object::Usage::visualOnly;
    std::optional<std::uint32_t> whole = own;
    if (owner) {
      std::vector<std::uint32_t>& objects = owned_[*owner];
      if (!whole && !objects.empty()) whole = objects.front();
      if (!whole) objects.push_back(*object);  // an invisible body
      ColliderProperties& properties = colliderProperties_[*owner];
      properties.colliders.insert(*object);
      readMaterial(number, collider, properties);
    }
    if (whole && *whole != *object) model_.objects[*object].partOf = *whole;
  }

  void readMaterial(std::size_t number, const Json& collider, ColliderProperties& properties) {
    const auto index = readIndexMember(&collider, "physicsMaterial");
    if (!index) return;
    const Json* material = findListEntry(findMember(document_, "physicsMaterials"), index);
    if (material == nullptr) return reportUnsupported(number, "unknown physicsMaterial");
    reportUnsupportedKeys(number, material, {"frictionCombine", "restitutionCombine"});
    // One coefficient for both; the dynamic one shows in sliding.
    const auto sliding = readNumberMember(material, "dynamicFriction");
    properties.friction = sliding ? sliding : readNumberMember(material, "staticFriction");
    properties.restitution = readNumberMember(material, "restitution");
  }

  void readTrigger(std::size_t number, const Json& trigger) {
    reportUnsupportedKeys(number, &trigger, {"collisionFilter", "nodes"});
    if (findMember(&trigger, "nodes") != nullptr) return;
    if (tree_.findOwner(number, motions_))
      return reportUnsupported(number, "a moving trigger is ignored");
    const auto object = makeGeometryObject(number, trigger, "/trigger");
    if (!object) return;
    const auto own = tree_.findObject(number);
    if (own && *own != *object) model_.objects[*own].usage = Object::Usage::visualOnly;
    BodySpec body;
    body.kind = BodyKind::trigger;
    body.source = BodySource::khr;
    body.name = getPath(number);
    body.objects = {*object};
    bodies_.push_back(std::move(body));
  }

  // ---- bodies ----

  void readMotion(std::size_t number) {
    const Json* motion = findMember(physics_.at(number), "motion");
    const auto objects = owned_.find(number);
    if (objects == owned_.end())
      return reportUnsupported(number, "motion of a node without any mesh");
    reportUnsupportedKeys(number, motion,
                          {"centerOfMass", "inertiaDiagonal", "inertiaOrientation"});
    if (readNumberMember(motion, "gravityFactor").value_or(1) != 1)
      reportUnsupported(number, "gravityFactor ignored");
    BodySpec body;
    body.source = BodySource::khr;
    body.name = getPath(number);
    body.objects = objects->second;
    body.mass = readNumberMember(motion, "mass");
    const Eigen::Matrix3d axes = extractAxes(tree_.worldFromNode(number));
    body.velocity = axes * readVectorMember(motion, "linearVelocity").value_or(Vec3::Zero());
    body.angularVelocity =
        axes * readVectorMember(motion, "angularVelocity").value_or(Vec3::Zero());
    applyColliderProperties(number, body);
    if (readFlagMember(motion, "isKinematic") || body.mass == 0.0) {
      body.mass.reset();
      staticNodes_.insert(number);  // unless a joint makes it kinematic
    }
    moving_.emplace(number, std::move(body));
  }

  void applyColliderProperties(std::size_t number, BodySpec& body) {
    const auto properties = colliderProperties_.find(number);
    if (properties == colliderProperties_.end()) return;  // its meshes are its collision geometry
    body.friction = properties->second.friction.value_or(body.friction);
    body.restitution = properties->second.restitution.value_or(body.restitution);
    for (const std::uint32_t object : body.objects) {
      Object& part = model_.objects[object];
      const bool collides = properties->second.colliders.contains(object);
      if (!collides && part.usage == Object::Usage::both) part.usage = Object::Usage::visualOnly;
    }
  }

  // ---- joints ----

  void readJoint(std::size_t number, const Json& joint) {
    const Json* description =
        findListEntry(findMember(document_, "physicsJoints"), readIndexMember(&joint, "joint"));
    const auto connected = readIndexMember(&joint, "connectedNode");
    if (description == nullptr || !connected || !tree_.transforms().contains(*connected))
      return reportUnsupported(number, "its joint or the node that it connects is missing");
    const auto here = tree_.findOwner(number, motions_),
               there = tree_.findOwner(*connected, motions_);
    if (here.has_value() == there.has_value())
      return reportUnsupported(number, here ? "a joint between two dynamic bodies is ignored"
                                            : "a joint without a dynamic body");
    const std::size_t body = here ? *here : *there;
    const auto found = moving_.find(body);
    if (found == moving_.end()) return;  // reported before
    reportUnsupportedKeys(number, description, {"drives"});
    if (const Json* limits = findMember(description, "limits"); limits && limits->is_array())
      for (const Json& one : *limits) reportUnsupportedKeys(number, &one, {"stiffness", "damping"});
    const std::string reason =
        applyJoint(number, *connected, *description, here.has_value(), found->second);
    if (!reason.empty()) return reportUnsupported(number, "its joint is ignored: " + reason);
    if (!jointed_.insert(body).second)
      reportUnsupported(number, "a second joint replaces the first");
    staticNodes_.erase(body);
  }

  /// Applies a joint. Returns the reason if it is unsupported. The joint coordinate is the position
  /// of the connected node in the node's frame.
  std::string applyJoint(std::size_t number, std::size_t connected, const Json& description,
                         bool isNodeDynamic, BodySpec& body) {
    const JointFreedoms freedoms = readFreedoms(description);
    if (!freedoms.unsupported.empty()) return freedoms.unsupported;
    const Eigen::Affine3d node = tree_.worldFromNode(number),
                          other = tree_.worldFromNode(connected);
    const Eigen::Matrix3d axes = extractAxes(node);
    if ((axes.transpose() * extractAxes(other)).diagonal().minCoeff() < 1 - kAlignmentTolerance)
      return "its two frames are rotated against each other";
    const auto hinge = findOnlyFreeAxis(freedoms.angular),
               slide = findOnlyFreeAxis(freedoms.linear);
    const bool isHinge = hinge && areAllLocked(freedoms.linear);
    const bool isSlider = slide && areAllLocked(freedoms.angular);
    if (!isHinge && !isSlider) return "it does not leave exactly one degree of freedom";
    const std::size_t axis = isHinge ? *hinge : *slide;
    const DegreeOfFreedom& freedom = isHinge ? freedoms.angular[axis] : freedoms.linear[axis];
    const Vec3 direction = axes.col(static_cast<Eigen::Index>(axis));
    const Vec3 offset = other.translation() - node.translation();
    const double position = isSlider ? offset.dot(direction) : 0;
    if ((offset - position * direction).norm() > kAlignmentTolerance)
      return "its two frames have an offset";
    if (isSlider && (!freedom.min || !freedom.max)) return "a slider needs both its limits";
    const double low = freedom.min.value_or(-kHalfTurn) - position;
    const double high = freedom.max.value_or(kHalfTurn) - position;
    if (!(low <= 0 && high >= 0 && low < high)) return "it starts outside its limits";
    body.kind = isHinge ? BodyKind::hinged : BodyKind::sliding;
    body.openedBy = OpenedBy::touch;
    body.anchor = node.translation();
    body.axis = direction;
    body.low = isNodeDynamic ? -high : low;
    body.high = isNodeDynamic ? -low : high;
    body.speed = isHinge ? kHalfTurn / 2 : 1;
    body.velocity = body.angularVelocity = Vec3::Zero();
    return {};
  }

  GltfTree& tree_;
  Model& model_;
  const Json* document_ = nullptr;
  std::map<std::size_t, const Json*> physics_;  // by node
  std::set<std::size_t> motions_, staticNodes_, jointed_;
  OwnedObjects owned_;
  std::map<std::size_t, ColliderProperties> colliderProperties_;  // by the node with the motion
  std::map<std::size_t, BodySpec> moving_;                        // by the node with the motion
  std::vector<BodySpec> bodies_;
  std::set<std::string> paths_;
};

}  // namespace

std::vector<BodySpec> readPhysicsBodies(GltfTree& tree) {
  return PhysicsReader(tree).read();
}

}  // namespace enfilade::scene
