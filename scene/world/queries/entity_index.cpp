#include "scene/world/queries/entity_index.hpp"

#include <algorithm>

namespace enfilade::scene {
namespace {

using collision::TreeOfParts;

EntityId firstAvatar(const SceneThen& then) {
  return static_cast<EntityId>(then.scene().model().objects.size()) + 1;
}

template <class Map, class Key>
const std::uint32_t* found(const Map& map, const Key& key) {
  const auto at = map.find(key);
  return at == map.end() ? nullptr : &at->second;
}

Placed placedAvatar(const AvatarView& avatar) {
  const auto& parts = avatar.shape->parts;
  std::vector<Box> boxes;
  for (const AvatarPart& part : parts) boxes.push_back(part.box);
  Placed placed;
  placed.own = std::make_shared<const collision::BoxTree>(collision::buildBoxTree(boxes, 1));
  placed.parts = parts.size();
  placed.trees.push_back({placed.own.get(), Mat3::Identity(), avatar.feet,
                          [&parts, &avatar, tree = placed.own.get()](std::uint32_t item) {
                            return bodyAt(parts[tree->order[item]], avatar.feet);
                          }});
  return placed;
}

Placed placedBody(const SceneThen& then, const BodyView& body) {
  const BodyShape& shape = *then.scene().shapeOfBody(body.index);
  Placed placed;
  placed.parts = shape.parts.size();
  placed.trees.push_back(treeAt(shape, body.pose));
  return placed;
}

Placed placedObject(const ObjectParts& parts) {
  Placed placed;
  placed.parts = parts.size();
  placed.trees = treesOf(parts);
  return placed;
}

Placed withoutBox(const SceneThen& then, EntityId entity) {
  if (const AvatarView* avatar = avatarOf(then, entity)) return placedAvatar(*avatar);
  if (const BodyView* body = bodyOf(then, entity)) return placedBody(then, *body);
  if (then.scene().model().objects[entity - 1].use == Object::Use::drawn) return {};
  return placedObject(then.scene().parts(entity - 1));
}

}  // namespace

SceneIndex::SceneIndex(std::shared_ptr<const Scene> scene) : scene_(std::move(scene)) {
  const Model& model = scene_->model();
  for (EntityId i = 0; i < model.objects.size(); ++i)
    objects_.emplace(model.objects[i].path, i + 1);
  for (std::uint32_t i = 0; i < model.bodies.size(); ++i) {
    bodies_.emplace(model.bodies[i].name, i);
    for (const std::uint32_t object : model.bodies[i].objects) bodyOfObject_[object + 1] = i;
  }
}

EntityId SceneIndex::objectOfPath(const std::string& path) const {
  const EntityId* id = found(objects_, path);
  return id ? *id : 0;
}

const std::uint32_t* SceneIndex::bodyNamed(const std::string& name) const {
  return found(bodies_, name);
}

const std::uint32_t* SceneIndex::bodyOfObject(EntityId id) const {
  return found(bodyOfObject_, id);
}

const AvatarView* avatarOf(const SceneThen& then, EntityId id) {
  const auto& avatars = then.snapshot.avatars;  // ascending
  const auto at = std::lower_bound(avatars.begin(), avatars.end(), id,
                                   [](const AvatarView& one, EntityId i) { return one.id < i; });
  return at == avatars.end() || at->id != id ? nullptr : &*at;
}

const BodyView* bodyOf(const SceneThen& then, EntityId id) {
  const std::uint32_t* body = then.index.bodyOfObject(id);
  if (!body || (*then.snapshot.bodies)[*body].id != id) return nullptr;
  return &(*then.snapshot.bodies)[*body];
}

EntityId entityWith(const SceneThen& then, EntityId id) {
  if (id >= firstAvatar(then)) return avatarOf(then, id) ? id : 0;
  const std::uint32_t* body = then.index.bodyOfObject(id);
  return body ? (*then.snapshot.bodies)[*body].id : id;
}

EntityId entityNamed(const SceneThen& then, const std::string& name) {
  for (const AvatarView& avatar : then.snapshot.avatars)
    if (avatar.name == name) return avatar.id;
  if (const std::uint32_t* body = then.index.bodyNamed(name))
    return (*then.snapshot.bodies)[*body].id;
  return entityWith(then, then.index.objectOfPath(name));
}

std::string nameOf(const SceneThen& then, EntityId entity) {
  if (const AvatarView* avatar = avatarOf(then, entity)) return avatar->name;
  if (const BodyView* body = bodyOf(then, entity))
    return then.scene().model().bodies[body->index].name;
  const bool isObject = entity != 0 && entity < firstAvatar(then);
  return isObject ? then.scene().model().objects[entity - 1].path : "";
}

Placed placedParts(const SceneThen& then, EntityId entity) {
  Placed placed = withoutBox(then, entity);
  for (const TreeOfParts& tree : placed.trees) placed.box.include(collision::boxOf(tree));
  return placed;
}

Box boxOf(const SceneThen& then, const BodyView& body) {
  constexpr double kRounding = 64 * 0x1p-53;  // as in collision/compound/compound_shape.cpp
  const BodyShape& shape = *then.scene().shapeOfBody(body.index);
  const Mat3 rotation = body.pose.rotation.toRotationMatrix();
  const Vec3 middle = rotation * shape.box.centre() + body.pose.translation;
  const Vec3 reach = rotation.cwiseAbs() * (0.5 * shape.box.size());
  const double size = body.pose.translation.cwiseAbs().maxCoeff() + 3 * shape.radius;
  return collision::grown(Box{middle - reach, middle + reach}, kRounding * size);
}

double gapOf(const Box& a, const Box& b) {
  return (a.min - b.max).cwiseMax(b.min - a.max).cwiseMax(0).norm();
}

}  // namespace enfilade::scene
