// The overlapping pairs of a sweep. Each change is recorded once. Internal to SortAndSweep.
#pragma once

#include "collision/broad_phase/sort_and_sweep_state.hpp"

namespace enfilade::collision {

/// Add and remove a pair. They do nothing if the pair exists, or does not exist.
void addStaticOverlap(SweepState& sweep, ProxyId id, StaticId other);
void removeStaticOverlap(SweepState& sweep, ProxyId id, StaticId other);
void addDynamicOverlap(SweepState& sweep, ProxyId a, ProxyId b);
void removeDynamicOverlap(SweepState& sweep, ProxyId a, ProxyId b);

/// The two parts of a change of a dynamic pair: the overlaps of one proxy, and the record.
void changeDynamicOverlap(SweepState& sweep, ProxyId id, ProxyId other, bool added);
void recordDynamicChange(SweepState& sweep, ProxyId a, ProxyId b, bool added);

/// Replaces the static overlaps of the proxy by `overlappingStatics`, which it sorts, and records
/// the differences.
void replaceStaticOverlaps(SweepState& sweep, ProxyId id);

}  // namespace enfilade::collision
