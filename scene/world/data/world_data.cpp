#include "scene/world/data/world_data.hpp"

#include <algorithm>

#include "collision/assert.hpp"

namespace enfilade::scene {
namespace {

/// Sets the index of each avatar from position `first` on; ignores ids that do not exist.
void updateAvatarIndices(WorldData& world, std::size_t first) {
  for (std::size_t i = first; i < world.avatars.size(); ++i)
    if (const std::size_t number = world.avatars[i].id - world.firstAvatarId();
        number < world.avatarIndices.size())
      world.avatarIndices[number] = static_cast<std::uint32_t>(i);
}

}  // namespace

std::string WorldData::findEntityName(EntityId id) const {
  const EntityId first = firstAvatarId();
  if (id == 0) return "";
  if (const auto body = bodyIndexById.find(id); body != bodyIndexById.end())
    return bodies[body->second].spec->name;
  if (id < first) return scene->model().objects[id - 1].path;
  return id - first < avatarNames.size() ? avatarNames[id - first] : "";
}

const Avatar* WorldData::findAvatar(EntityId id) const {
  const std::size_t number = id - firstAvatarId();
  if (number >= avatarIndices.size() || avatarIndices[number] == kNoAvatar) return nullptr;
  return &avatars[avatarIndices[number]];
}
Avatar* WorldData::findAvatar(EntityId id) {
  return const_cast<Avatar*>(std::as_const(*this).findAvatar(id));
}

const Avatar* WorldData::findAvatarByName(std::string_view name) const {
  ENFILADE_ASSERT(std::ranges::is_sorted(avatars, {}, &Avatar::name));
  const auto at = std::ranges::lower_bound(avatars, name, {}, &Avatar::name);
  return at != avatars.end() && at->name == name ? &*at : nullptr;
}

const Avatar* WorldData::findAvatarByProxy(collision::ProxyId proxy) const {
  return proxy < avatarByProxy.size() ? findAvatar(avatarByProxy[proxy]) : nullptr;
}
Avatar* WorldData::findAvatarByProxy(collision::ProxyId proxy) {
  return const_cast<Avatar*>(std::as_const(*this).findAvatarByProxy(proxy));
}

std::uint32_t WorldData::findBodyByProxy(collision::ProxyId proxy) const {
  return proxy < bodyIndexByProxy.size() ? bodyIndexByProxy[proxy] : kNoBody;
}

const Body* WorldData::findBodyByName(std::string_view name) const {
  const auto at = bodyIndexByName.find(name);
  return at == bodyIndexByName.end() ? nullptr : &bodies[at->second];
}

const Contact* WorldData::findBodyContact(const EntityPair& pair) const {
  const auto at =
      std::ranges::lower_bound(bodyContacts, pair, {}, &BodyContacts::value_type::first);
  return at != bodyContacts.end() && at->first == pair ? &at->second : nullptr;
}

EntityId WorldData::insertAvatar(Avatar avatar) {
  const EntityId id = firstAvatarId() + static_cast<EntityId>(avatarNames.size());
  avatar.id = id;
  setAvatarProxy(avatar, avatar.proxy);
  avatarNames.push_back(avatar.name);
  avatarIndices.push_back(kNoAvatar);
  ENFILADE_ASSERT(std::ranges::is_sorted(avatars, {}, &Avatar::name));
  const auto at = std::ranges::lower_bound(avatars, avatar.name, {}, &Avatar::name);
  const auto index = static_cast<std::size_t>(at - avatars.begin());
  avatars.insert(at, std::move(avatar));
  updateAvatarIndices(*this, index);
  return id;
}

void WorldData::eraseAvatar(EntityId id) {
  std::uint32_t& entry = avatarIndices[id - firstAvatarId()];
  const std::uint32_t index = entry;
  avatarByProxy[avatars[index].proxy] = 0;
  entry = kNoAvatar;
  avatars.erase(avatars.begin() + index);
  updateAvatarIndices(*this, index);
}

void WorldData::linkAvatars() {
  avatarIndices.assign(avatarNames.size(), kNoAvatar);
  updateAvatarIndices(*this, 0);
  for (OrderQueue& queue : queues) {
    const Avatar* avatar = findAvatarByName(queue.name);
    queue.avatar = avatar ? avatar->id : 0;
  }
}

void WorldData::setAvatarProxy(Avatar& avatar, collision::ProxyId proxy) {
  avatar.proxy = proxy;
  if (proxy >= avatarByProxy.size()) avatarByProxy.resize(proxy + 1, 0);
  avatarByProxy[proxy] = avatar.id;
}

}  // namespace enfilade::scene
