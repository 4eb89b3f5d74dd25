#include "scene/world/queries/entity_index.hpp"

#include <algorithm>

#include "collision/assert.hpp"

namespace enfilade::scene {
namespace {

using collision::CompoundView;

EntityId getFirstAvatarId(const SceneAt& sceneAt) {
  return static_cast<EntityId>(sceneAt.scene().model().objects.size()) + 1;
}

template <class Map, class Key>
const std::uint32_t* findValue(const Map& map, const Key& key) {
  const auto at = map.find(key);
  return at == map.end() ? nullptr : &at->second;
}

PlacedEntity makePlacedAvatar(const AvatarSnapshot& avatar) {
  const auto& parts = avatar.shape->parts;
  std::vector<Aabb> boxes;
  for (const AvatarPart& part : parts) boxes.push_back(part.box);
  PlacedEntity placed;
  placed.ownedTree = std::make_shared<const collision::BoxTree>(collision::buildBoxTree(boxes, 1));
  placed.partCount = parts.size();
  placed.compounds.push_back({placed.ownedTree.get(), Mat3::Identity(), avatar.footPosition,
                              [&parts, &avatar, tree = placed.ownedTree.get()](std::uint32_t item) {
                                return placeAvatarPart(parts[tree->order[item]],
                                                       avatar.footPosition);
                              }});
  return placed;
}

PlacedEntity makePlacedBody(const SceneAt& sceneAt, const BodySnapshot& body) {
  const BodyShape& shape = *sceneAt.scene().bodyShape(body.index);
  PlacedEntity placed;
  placed.partCount = shape.parts.size();
  placed.compounds.push_back(makeCompoundView(shape, body.pose));
  return placed;
}

PlacedEntity makePlacedObject(const CollisionGeometry& geometry) {
  PlacedEntity placed;
  placed.partCount = geometry.size();
  placed.compounds = makeCompoundViews(geometry);
  return placed;
}

PlacedEntity makePlacedWithoutBox(const SceneAt& sceneAt, EntityId entity) {
  if (const AvatarSnapshot* avatar = findAvatarSnapshot(sceneAt, entity))
    return makePlacedAvatar(*avatar);
  if (const BodySnapshot* body = findBodySnapshot(sceneAt, entity))
    return makePlacedBody(sceneAt, *body);
  if (sceneAt.scene().model().objects[entity - 1].usage == Object::Usage::visualOnly) return {};
  return makePlacedObject(sceneAt.scene().collisionGeometry(entity - 1));
}

}  // namespace

EntityIndex::EntityIndex(std::shared_ptr<const Scene> scene) : scene_(std::move(scene)) {
  const Model& model = scene_->model();
  for (EntityId i = 0; i < model.objects.size(); ++i)
    objects_.emplace(model.objects[i].path, i + 1);
  for (std::uint32_t i = 0; i < model.bodies.size(); ++i) {
    bodies_.emplace(model.bodies[i].name, i);
    for (const std::uint32_t object : model.bodies[i].objects) bodyOfObject_[object + 1] = i;
  }
}

EntityId EntityIndex::findObject(const std::string& path) const {
  const EntityId* id = findValue(objects_, path);
  return id ? *id : 0;
}

const std::uint32_t* EntityIndex::findBody(const std::string& name) const {
  return findValue(bodies_, name);
}

const std::uint32_t* EntityIndex::findBodyOfObject(EntityId id) const {
  return findValue(bodyOfObject_, id);
}

const AvatarSnapshot* findAvatarSnapshot(const SceneAt& sceneAt, EntityId id) {
  const auto& avatars = sceneAt.snapshot.avatars;
  ENFILADE_ASSERT(std::ranges::is_sorted(avatars, {}, &AvatarSnapshot::id));
  const auto at =
      std::lower_bound(avatars.begin(), avatars.end(), id,
                       [](const AvatarSnapshot& one, EntityId i) { return one.id < i; });
  return at == avatars.end() || at->id != id ? nullptr : &*at;
}

const BodySnapshot* findBodySnapshot(const SceneAt& sceneAt, EntityId id) {
  const std::uint32_t* body = sceneAt.index.findBodyOfObject(id);
  if (!body || (*sceneAt.snapshot.bodies)[*body].id != id) return nullptr;
  return &(*sceneAt.snapshot.bodies)[*body];
}

EntityId resolveEntity(const SceneAt& sceneAt, EntityId id) {
  if (id >= getFirstAvatarId(sceneAt)) return findAvatarSnapshot(sceneAt, id) ? id : 0;
  const std::uint32_t* body = sceneAt.index.findBodyOfObject(id);
  return body ? (*sceneAt.snapshot.bodies)[*body].id : id;
}

EntityId findEntity(const SceneAt& sceneAt, const std::string& name) {
  for (const AvatarSnapshot& avatar : sceneAt.snapshot.avatars)
    if (avatar.name == name) return avatar.id;
  if (const std::uint32_t* body = sceneAt.index.findBody(name))
    return (*sceneAt.snapshot.bodies)[*body].id;
  return resolveEntity(sceneAt, sceneAt.index.findObject(name));
}

std::string lookUpEntityName(const SceneAt& sceneAt, EntityId entity) {
  if (const AvatarSnapshot* avatar = findAvatarSnapshot(sceneAt, entity)) return avatar->name;
  if (const BodySnapshot* body = findBodySnapshot(sceneAt, entity))
    return sceneAt.scene().model().bodies[body->index].name;
  const bool isObject = entity != 0 && entity < getFirstAvatarId(sceneAt);
  return isObject ? sceneAt.scene().model().objects[entity - 1].path : "";
}

PlacedEntity makePlacedEntity(const SceneAt& sceneAt, EntityId entity) {
  PlacedEntity placed = makePlacedWithoutBox(sceneAt, entity);
  for (const CompoundView& view : placed.compounds)
    placed.box.include(collision::computeAabb(view));
  return placed;
}

Aabb computeBodyAabb(const SceneAt& sceneAt, const BodySnapshot& body) {
  constexpr double kRounding = 64 * 0x1p-53;  // as in collision/compound/compound_view.cpp
  const BodyShape& shape = *sceneAt.scene().bodyShape(body.index);
  const Mat3 rotation = body.pose.rotation.toRotationMatrix();
  const Vec3 middle = rotation * shape.box.centre() + body.pose.translation;
  const Vec3 halfExtent = rotation.cwiseAbs() * (0.5 * shape.box.size());
  const double size = body.pose.translation.cwiseAbs().maxCoeff() + 3 * shape.radius;
  return collision::inflate(Aabb{middle - halfExtent, middle + halfExtent}, kRounding * size);
}

}  // namespace enfilade::scene
