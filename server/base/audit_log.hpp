// What the audits of a world found, for its log and for whoever ends with it.
#pragma once

#include <cstdint>
#include <string>

#include "scene/world/world.hpp"

namespace enfilade::server {

/// Of all audited ticks.
struct AuditTotals {
  std::uint64_t ticks = 0;
  std::uint64_t pairs = 0;   ///< that brute force found
  std::uint64_t missed = 0;  ///< of those, unknown to the broad phase
  std::uint64_t extra = 0;   ///< held by the broad phase, but not found

  void add(const scene::TickAudit& audit);
  void add(const AuditTotals& others);
  bool right() const { return missed == 0 && extra == 0; }
};

/// One finding for a person: the tick, both objects by name, and both boxes.
std::string textOf(const scene::World& world, std::uint64_t tick,
                   const scene::AuditFinding& finding);

/// Logs what the audit of the last tick found as errors, the first few one by one.
void logFindings(const scene::World& world, const scene::TickReport& report);

/// Logs what was found in all: as an error unless all was right.
void logTotals(const AuditTotals& totals);

}  // namespace enfilade::server
