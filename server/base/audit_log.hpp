// Totals and log output of the broad-phase audits of a world.
#pragma once

#include <cstdint>
#include <string>

#include "scene/world/world.hpp"

namespace enfilade::server {

/// Totals over all audited ticks.
struct AuditTotals {
  std::uint64_t ticks = 0;
  std::uint64_t pairs = 0;   ///< found by brute force
  std::uint64_t missed = 0;  ///< of `pairs`, missing in the broad phase
  std::uint64_t extra = 0;   ///< in the broad phase, but not found by brute force

  void addTick(const scene::TickAudit& audit);
  void addTotals(const AuditTotals& others);
  bool isClean() const { return missed == 0 && extra == 0; }
};

/// A finding as readable text: the tick, both entities by name, and both AABBs.
std::string formatFinding(const scene::World& world, std::uint64_t tick,
                          const scene::AuditFinding& finding);

/// Logs the findings of the last tick's audit as errors: the first few individually.
void logFindings(const scene::World& world, const scene::TickReport& report);

/// Logs the totals: as an error if a pair was missed or extra.
void logTotals(const AuditTotals& totals);

}  // namespace enfilade::server
