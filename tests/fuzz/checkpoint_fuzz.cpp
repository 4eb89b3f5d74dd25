// Fuzz target of checkpoints with a correct checksum: they make a world that can tick, or none. If
// the first byte is even, the rest is a world's bytes. Otherwise the rest patches the checkpoint of
// a busy room: repeatedly an offset (two bytes) and the new content.
#include <vector>

#include "scene/world/checkpoint/checkpoint.hpp"
#include "tests/fuzz/fuzz_target.hpp"
#include "tests/server/body_room.hpp"

namespace enfilade::fuzz {
namespace {

using Bytes = std::span<const std::uint8_t>;

std::shared_ptr<const scene::Scene> getRoom() {
  static const std::shared_ptr<const scene::Scene> one = server::testing::makeBodyRoom();
  return one;
}

/// Two avatars that walk towards one another, one in the air, and a door that opens.
std::vector<std::uint8_t> saveBusyRoom() {
  scene::World world(getRoom());
  for (const double x : {-4.0, -1.0, 4.0}) {
    const std::string name = "from" + std::to_string(static_cast<int>(x));
    scene::Spawn spawn;
    spawn.position = {x, x > 0 ? 1.5 : 0.01, 0};
    scene::Walk walk;
    walk.waypoints = {{-x, 0, 0.5}};
    require(!scene::submitAvatarCommand(world, {name, spawn}), "the avatar can spawn");
    require(!scene::submitAvatarCommand(world, {name, walk}), "the avatars can walk");
  }
  for (int i = 0; i < 20; ++i) scene::tickWorld(world);
  return scene::makeCheckpoint(world);
}

const std::vector<std::uint8_t>& getGenuine() {
  static const std::vector<std::uint8_t> one = saveBusyRoom();
  return one;
}

/// Magic, version, scene, length of the world, the world, room for the checksum.
std::vector<std::uint8_t> wrapWorld(Bytes world) {
  constexpr std::size_t kWord = 8;
  std::vector<std::uint8_t> bytes(getGenuine().begin(), getGenuine().begin() + 3 * kWord);
  for (std::size_t i = 0; i < kWord; ++i)
    bytes.push_back(static_cast<std::uint8_t>(world.size() >> (8 * i)));
  bytes.insert(bytes.end(), world.begin(), world.end());
  bytes.resize(bytes.size() + kWord);
  return bytes;
}

std::vector<std::uint8_t> overlayGenuine(Bytes changes) {
  std::vector<std::uint8_t> bytes = getGenuine();
  for (; changes.size() >= 3; changes = changes.subspan(3))
    bytes[(changes[0] | std::size_t{changes[1]} << 8) % bytes.size()] = changes[2];
  return bytes;
}

}  // namespace

void tryBytes(Bytes bytes) {
  if (bytes.empty()) return;
  const Bytes rest = bytes.subspan(1);
  std::vector<std::uint8_t> checkpoint = bytes[0] & 1 ? overlayGenuine(rest) : wrapWorld(rest);
  scene::recomputeChecksum(checkpoint);
  try {
    scene::World world = scene::restoreWorld(getRoom(), checkpoint);
    for (int i = 0; i < 3; ++i) scene::tickWorld(world);
    scene::makeCheckpoint(world);
  } catch (const scene::CheckpointError& error) {
    require(error.what()[0] != '\0', "an error has a message");
  }
}

}  // namespace enfilade::fuzz
