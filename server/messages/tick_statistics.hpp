// Statistics over all ticks of a world (durations and counters) in bounded memory.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "protocol/enfilade.pb.h"
#include "scene/world/world.hpp"
#include "server/base/audit_log.hpp"

namespace enfilade::server {

/// Histogram of durations. Buckets are 64 in each power of two (at most 1.6 % wide), from 1 ns to
/// about 18 h.
class DurationHistogram {
 public:
  void record(double seconds);
  std::uint64_t count() const { return count_; }
  double sum() const { return sum_; }  ///< seconds
  double max() const { return max_; }  ///< seconds, exact
  /// Seconds, accurate to a bucket; `fraction` 0.5 is the median. 0 without samples.
  double quantile(double fraction) const;

 private:
  std::vector<std::uint64_t> buckets_;
  std::uint64_t count_ = 0;
  double sum_ = 0, max_ = 0;
};

class TickStatistics {
 public:
  void addTick(const scene::TickReport& report);
  double worstPenetration() const { return worstPenetration_; }
  const AuditTotals& audit() const { return audit_; }
  /// Fills the fields that depend on ticks. The caller adds clients, frames and drops.
  v1::Metrics makeMetrics() const;

 private:
  std::array<DurationHistogram, scene::kStageCount> stageDurations_;
  DurationHistogram tickDurations_;
  std::uint64_t contacts_ = 0, narrowQueries_ = 0, rationalQueries_ = 0, crushedBodies_ = 0,
                verticesLookedAt_ = 0, partBoxesMade_ = 0, partsLookedAt_ = 0;
  scene::AvatarWork costliestAvatar_;          ///< the most narrow-phase queries in a tick
  std::vector<scene::AvatarWork> avatarWork_;  ///< of the last tick
  std::uint64_t costliestTick_ = 0, lastTick_ = 0;
  std::uint32_t pairs_ = 0, activeContacts_ = 0, avatars_ = 0;
  double worstPenetration_ = 0;  ///< metres
  AuditTotals audit_;
  DurationHistogram auditDurations_;
};

}  // namespace enfilade::server
