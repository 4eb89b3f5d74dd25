// A world as bytes, and back: whole, with all that may change the last bits of what comes later, so
// that the copy goes on with the state hash of the original at every tick.
//
// The bytes are of one version of this program's layout (kCheckpointVersion). They begin with eight
// bytes that tell what they are, the version, the scene's hash and the length of what follows, and
// end with a checksum. What can be worked out exactly is not among them: the scene, shapes that
// follow from the orders that made them, pairs of boxes.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <stdexcept>
#include <vector>

#include "scene/world/world.hpp"

namespace enfilade::scene {

/// Goes up whenever the bytes of the same world would be others.
inline constexpr std::uint32_t kCheckpointVersion = 3;

/// Why bytes make no world: what is wrong, and where.
struct CheckpointError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Between two ticks. Whether ticks are audited, and by how many threads they are made, is no part
/// of it.
std::vector<std::uint8_t> checkpointOf(const World& world);

/// The world of which `checkpoint` was taken, in the same scene. Throws CheckpointError where the
/// bytes are damaged, of another version or scene, or where no world can be as they say.
World worldFrom(std::shared_ptr<const Scene> scene, std::span<const std::uint8_t> checkpoint);

/// That the bytes say they are of; 0: they are no checkpoint.
std::uint32_t checkpointVersion(std::span<const std::uint8_t> checkpoint);

/// Makes the checksum fit bytes that were changed on purpose, as a test does.
void sealCheckpoint(std::vector<std::uint8_t>& bytes);

}  // namespace enfilade::scene
