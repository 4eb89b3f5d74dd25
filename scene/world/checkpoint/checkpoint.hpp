// Checkpoints: the complete state of a world as bytes. A restored world has the same state hash as
// the original at every later tick.
// The layout belongs to one version (kCheckpointVersion). The bytes are: 8 bytes of magic, the
// version, the scene's hash, the length of the content, the content, a checksum. State that can be
// recomputed exactly is left out: the scene, shapes that follow from spawn orders, pairs of AABBs.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "scene/world/checkpoint/checkpoint_error.hpp"
#include "scene/world/world.hpp"

namespace enfilade::scene {

/// Increases with every change of the layout.
inline constexpr std::uint32_t kCheckpointVersion = 10;

/// Call between two ticks. Auditing and the number of threads are not part of a checkpoint.
std::vector<std::uint8_t> makeCheckpoint(const World& world);

/// Restores the world of `checkpoint` in the same scene. Throws CheckpointError if the bytes are
/// damaged, have another version or scene, or describe an impossible world.
World restoreWorld(std::shared_ptr<const Scene> scene, std::span<const std::uint8_t> checkpoint);

/// Version in the header; 0: not a checkpoint.
std::uint32_t readCheckpointVersion(std::span<const std::uint8_t> checkpoint);

/// Recomputes the checksum after a deliberate change of the bytes, for tests.
void recomputeChecksum(std::vector<std::uint8_t>& bytes);

}  // namespace enfilade::scene
