// Checkpoints, with a checksum that fits: they make a world that ticks, or none. The first byte
// tells whether the rest stands for a world's bytes (even), or is laid over those of a busy room's
// checkpoint (odd: a place, two bytes, and what stands there, again and again).
#include <vector>

#include "scene/world/checkpoint/checkpoint.hpp"
#include "tests/fuzz/fuzz_target.hpp"
#include "tests/server/body_room.hpp"

namespace enfilade::fuzz {
namespace {

using Bytes = std::span<const std::uint8_t>;

std::shared_ptr<const scene::Scene> room() {
  static const std::shared_ptr<const scene::Scene> one = server::testing::bodyRoom();
  return one;
}

/// Two who walk towards one another, one in the air, and a door that opens.
std::vector<std::uint8_t> busyRoom() {
  scene::World world(room());
  for (const double x : {-4.0, -1.0, 4.0}) {
    const std::string name = "from" + std::to_string(static_cast<int>(x));
    scene::Spawn spawn;
    spawn.at = {x, x > 0 ? 1.5 : 0.01, 0};
    scene::Walk walk;
    walk.along = {{-x, 0, 0.5}};
    require(!scene::submit(world, {name, spawn}), "there is room");
    require(!scene::submit(world, {name, walk}), "they can walk");
  }
  for (int i = 0; i < 20; ++i) scene::tick(world);
  return scene::checkpointOf(world);
}

const std::vector<std::uint8_t>& genuine() {
  static const std::vector<std::uint8_t> one = busyRoom();
  return one;
}

/// What it is, the version, the scene, the length of the world, the world, room for the checksum.
std::vector<std::uint8_t> wrapped(Bytes world) {
  constexpr std::size_t kWord = 8;
  std::vector<std::uint8_t> bytes(genuine().begin(), genuine().begin() + 3 * kWord);
  for (std::size_t i = 0; i < kWord; ++i)
    bytes.push_back(static_cast<std::uint8_t>(world.size() >> (8 * i)));
  bytes.insert(bytes.end(), world.begin(), world.end());
  bytes.resize(bytes.size() + kWord);
  return bytes;
}

std::vector<std::uint8_t> overlaid(Bytes changes) {
  std::vector<std::uint8_t> bytes = genuine();
  for (; changes.size() >= 3; changes = changes.subspan(3))
    bytes[(changes[0] | std::size_t{changes[1]} << 8) % bytes.size()] = changes[2];
  return bytes;
}

}  // namespace

void tryBytes(Bytes bytes) {
  if (bytes.empty()) return;
  const Bytes rest = bytes.subspan(1);
  std::vector<std::uint8_t> checkpoint = bytes[0] & 1 ? overlaid(rest) : wrapped(rest);
  scene::sealCheckpoint(checkpoint);
  try {
    scene::World world = scene::worldFrom(room(), checkpoint);
    for (int i = 0; i < 3; ++i) scene::tick(world);
    scene::checkpointOf(world);
  } catch (const scene::CheckpointError& error) {
    require(error.what()[0] != '\0', "an error says what is wrong");
  }
}

}  // namespace enfilade::fuzz
