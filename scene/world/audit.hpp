// Audit of a live world's broad phase: compares its pairs in a tick with brute force over the same
// boxes. Only reads the world; results are bit-identical with and without it.
#pragma once

#include <cstddef>
#include <cstdint>

#include "scene/world/data/tick_report.hpp"
#include "scene/world/data/world_data.hpp"

namespace enfilade::scene {

/// Maximum interval between two audits, ticks.
inline constexpr std::uint32_t kMaxAuditInterval = 1'000'000;

/// Maximum box tests of one audit, unless one proxy needs more. About 2 ms: a brute-force test
/// takes 5 ns, because its branches are unpredictable.
inline constexpr std::size_t kMaxAuditBoxTests = 400'000;

bool isAuditDue(const WorldData& world);  ///< in this tick

/// Call right after the update of the broad phase, before any proxy moves or is removed.
TickAudit auditTick(WorldData& world, std::size_t maxBoxTests = kMaxAuditBoxTests);

}  // namespace enfilade::scene
