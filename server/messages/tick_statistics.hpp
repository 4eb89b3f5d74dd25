// How long ticks take and what they did, kept in bounded memory however long the server runs.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "protocol/enfilade.pb.h"
#include "scene/world/world.hpp"
#include "server/base/audit_log.hpp"

namespace enfilade::server {

/// A histogram of durations with buckets 1/64 of an octave wide (1.1 %), from 1 ns to about 18 h.
class DurationHistogram {
 public:
  void add(double seconds);
  std::uint64_t count() const { return count_; }
  double sum() const { return sum_; }  ///< seconds
  double max() const { return max_; }  ///< seconds, exact
  /// Seconds, within a bucket; `fraction` 0.5 is the median. 0 when nothing was added.
  double quantile(double fraction) const;

 private:
  std::vector<std::uint64_t> buckets_;
  std::uint64_t count_ = 0;
  double sum_ = 0, max_ = 0;
};

class TickStatistics {
 public:
  void add(const scene::TickReport& report);
  double worstPenetration() const { return worstPenetration_; }
  const AuditTotals& audit() const { return audit_; }
  /// Fills what ticks know; clients, frames and drops are the server's to fill.
  v1::Metrics metrics() const;

 private:
  std::array<DurationHistogram, scene::kStages> stages_;
  DurationHistogram tick_;
  std::uint64_t contacts_ = 0, narrowQueries_ = 0, rationalQueries_ = 0, squeezedBodies_ = 0;
  std::uint32_t pairs_ = 0, liveContacts_ = 0, avatars_ = 0;
  double worstPenetration_ = 0;  ///< metres
  AuditTotals audit_;
  DurationHistogram audited_;
};

}  // namespace enfilade::server
