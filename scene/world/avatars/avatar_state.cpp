// What the state hash and the snapshot take of an avatar.
#include "scene/world/data/world_data.hpp"

namespace enfilade::scene {
namespace {

/// What most avatars do not have costs one word.
void hashWhatIsRare(const Avatar& avatar, Hasher& hash) {
  const bool crouches = avatar.height != avatar.standing;
  hash.add(std::uint64_t{avatar.grounded} | std::uint64_t{avatar.flying} << 1 |
           std::uint64_t{avatar.jumping} << 2 | std::uint64_t{avatar.blockedTold} << 3 |
           std::uint64_t{crouches} << 4 | std::uint64_t{!avatar.chain.links.empty()} << 5);
  if (crouches) hash.add(avatar.height);
  if (avatar.chain.links.empty()) return;
  hash.add(avatar.chain.speed);
  hash.add(avatar.chain.patienceLeft);
  for (const ChainLink& link : avatar.chain.links) {
    hash.add(link.value);
    hash.add(link.target);
  }
}

}  // namespace

void hashAvatar(const Avatar& avatar, Hasher& hash) {
  hash.add(std::uint64_t{avatar.id});
  hash.add(avatar.feet);
  hash.add(avatar.gaze);
  hash.add(avatar.fallSpeed);
  hash.add(std::uint64_t{avatar.standsOn});
  hash.add(avatar.drive);
  hash.add(std::uint64_t{avatar.walk.leg});
  hash.add(avatar.walk.nearest);
  hash.add(avatar.walk.patienceLeft);
  hash.add(avatar.waitLeft);
  hash.add(avatar.hangsFor);
  hashWhatIsRare(avatar, hash);
  for (const Contact& contact : avatar.contacts)
    hash.add((std::uint64_t{contact.other} << 1) | std::uint64_t{contact.touching});
}

AvatarView viewOf(const std::string& name, const Avatar& avatar) {
  AvatarView view;
  view.id = avatar.id;
  view.name = name;
  view.feet = avatar.feet;
  view.gaze = avatar.gaze;
  view.eyeHeight = avatar.eyeHeight;
  view.grounded = avatar.grounded;
  view.shape = avatar.shape;
  view.flying = avatar.flying;
  view.standsOn = avatar.standsOn;
  view.height = avatar.height;
  view.standing = avatar.standing;
  view.move = {avatar.asked, avatar.lastMove, avatar.stoppedBy, avatar.atStop};
  for (const ChainLink& link : avatar.chain.links)
    view.joints.push_back({link.value, link.stoppedBy, leverOf(link)});
  return view;
}

}  // namespace enfilade::scene
