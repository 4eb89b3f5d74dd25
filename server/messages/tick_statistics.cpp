#include "server/messages/tick_statistics.hpp"

#include <algorithm>
#include <bit>
#include <cstdint>

#include "collision/assert.hpp"
#include "server/messages/world_messages.hpp"

namespace enfilade::server {

namespace {

// A bucket has the exponent and the first bits of the mantissa of a duration in nanoseconds. There
// are 64 buckets for each power of two, and no logarithm in each stage of each tick.
constexpr int kMantissaBits = 6, kDroppedBits = 52 - kMantissaBits;
constexpr std::uint64_t kFirstBucket = std::uint64_t{1023} << kMantissaBits;  // of 1 ns
constexpr std::size_t kBucketCount = 46 << kMantissaBits;                     // 2^46 ns

constexpr std::size_t kMaxAvatarWork = 1000;  // in a message

std::size_t findBucket(double seconds) {
  const double nanoseconds = seconds * 1e9;
  if (!(nanoseconds > 1)) return 0;
  const std::uint64_t bucket =
      (std::bit_cast<std::uint64_t>(nanoseconds) >> kDroppedBits) - kFirstBucket;
  return std::min<std::size_t>(bucket, kBucketCount - 1);
}

double computeBucketMidpoint(std::size_t bucket) {
  const std::uint64_t start = (bucket + kFirstBucket) << kDroppedBits;
  constexpr std::uint64_t kHalf = std::uint64_t{1} << (kDroppedBits - 1);
  return std::bit_cast<double>(start | kHalf) * 1e-9;
}

void fillAvatarWork(v1::AvatarWork& message, const scene::AvatarWork& work, std::uint64_t tick) {
  message.set_id(work.id);
  message.set_tick(tick);
  message.set_narrow_queries(work.narrowQueries);
  message.set_parts_looked_at(work.partsLookedAt);
  *message.mutable_position() = toProto(work.footPosition);
}

void fillTiming(v1::StageTiming& timing, const char* name, const DurationHistogram& durations) {
  timing.set_name(name);
  timing.set_median_us(durations.quantile(0.5) * 1e6);
  timing.set_p99_us(durations.quantile(0.99) * 1e6);
  timing.set_max_us(durations.max() * 1e6);
}

void fillAudit(v1::Audit& message, const AuditTotals& totals, const DurationHistogram& durations) {
  message.set_ticks(totals.ticks);
  message.set_pairs(totals.pairs);
  message.set_missed(totals.missed);
  message.set_extra(totals.extra);
  fillTiming(*message.mutable_timing(), "audit", durations);
}

}  // namespace

void DurationHistogram::record(double seconds) {
  if (buckets_.empty()) buckets_.resize(kBucketCount);
  ++buckets_[findBucket(seconds)];
  ++count_;
  sum_ += seconds;
  max_ = std::max(max_, seconds);
}

double DurationHistogram::quantile(double fraction) const {
  ENFILADE_ASSERT(fraction >= 0 && fraction <= 1);
  if (count_ == 0) return 0;
  const auto rank = static_cast<std::uint64_t>(fraction * static_cast<double>(count_ - 1));
  std::uint64_t cumulative = 0;
  for (std::size_t i = 0; i < buckets_.size(); ++i) {
    cumulative += buckets_[i];
    if (cumulative > rank) return std::min(computeBucketMidpoint(i), max_);
  }
  return max_;
}

void TickStatistics::addTick(const scene::TickReport& report) {
  double totalSeconds = 0;
  for (std::size_t i = 0; i < scene::kStageCount; ++i) {
    stageDurations_[i].record(report.stageSeconds[i]);
    totalSeconds += report.stageSeconds[i];
  }
  if (report.audit) {
    audit_.addTick(*report.audit);
    auditDurations_.record(report.audit->seconds);
    totalSeconds += report.audit->seconds;
  }
  tickDurations_.record(totalSeconds);
  for (const scene::ContactEvent& event : report.contacts) {
    if (event.kind == scene::ContactEvent::Kind::begin) ++contacts_;
  }
  narrowQueries_ += report.narrowQueries;
  rationalQueries_ += report.rationalQueries;
  crushedBodies_ += report.crushedBodies;
  verticesLookedAt_ += report.verticesLookedAt;
  partBoxesMade_ += report.partBoxesMade;
  partsLookedAt_ += report.partsLookedAt;
  for (const scene::AvatarWork& work : report.avatarWork) {
    if (work.narrowQueries <= costliestAvatar_.narrowQueries) continue;
    costliestAvatar_ = work;
    costliestTick_ = report.snapshot->tick;
  }
  avatarWork_ = report.avatarWork;
  lastTick_ = report.snapshot->tick;
  pairs_ = report.pairs;
  activeContacts_ = report.activeContacts;
  avatars_ = static_cast<std::uint32_t>(report.snapshot->avatars.size());
  worstPenetration_ = std::max(worstPenetration_, report.maxPenetration);
}

v1::Metrics TickStatistics::makeMetrics() const {
  v1::Metrics metrics;
  metrics.set_ticks(tickDurations_.count());
  if (tickDurations_.sum() > 0) {
    metrics.set_ticks_per_second(static_cast<double>(tickDurations_.count()) /
                                 tickDurations_.sum());
  }
  for (std::size_t i = 0; i < scene::kStageCount; ++i) {
    fillTiming(*metrics.add_stages(), scene::kStageNames[i], stageDurations_[i]);
  }
  fillTiming(*metrics.mutable_tick(), "tick", tickDurations_);
  metrics.set_pairs(pairs_);
  metrics.set_live_contacts(activeContacts_);
  metrics.set_contacts(contacts_);
  metrics.set_narrow_queries(narrowQueries_);
  metrics.set_rational_queries(rationalQueries_);
  metrics.set_worst_penetration(worstPenetration_);
  metrics.set_squeezed_bodies(crushedBodies_);
  metrics.set_vertices_looked_at(verticesLookedAt_);
  metrics.set_part_boxes_made(partBoxesMade_);
  metrics.set_parts_looked_at(partsLookedAt_);
  if (costliestAvatar_.id != 0)
    fillAvatarWork(*metrics.mutable_costliest_avatar(), costliestAvatar_, costliestTick_);
  std::vector<scene::AvatarWork> avatarWork = avatarWork_;
  std::ranges::sort(avatarWork, {}, &scene::AvatarWork::id);
  avatarWork.resize(std::min(avatarWork.size(), kMaxAvatarWork));
  for (const scene::AvatarWork& work : avatarWork)
    fillAvatarWork(*metrics.add_avatar_work(), work, lastTick_);
  metrics.set_avatars(avatars_);
  if (audit_.ticks > 0) fillAudit(*metrics.mutable_audit(), audit_, auditDurations_);
  return metrics;
}

}  // namespace enfilade::server
