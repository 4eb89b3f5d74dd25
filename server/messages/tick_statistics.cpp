#include "server/messages/tick_statistics.hpp"

#include <algorithm>
#include <cmath>

namespace enfilade::server {

namespace {

constexpr double kBucketsPerOctave = 64;
constexpr std::size_t kBuckets = 64 * 46;  // 2^46 ns

std::size_t bucketOf(double seconds) {
  const double nanoseconds = seconds * 1e9;
  if (!(nanoseconds > 1)) return 0;
  const double bucket = std::log2(nanoseconds) * kBucketsPerOctave;
  return std::min(static_cast<std::size_t>(bucket), kBuckets - 1);
}

double middleOf(std::size_t bucket) {
  return std::exp2((static_cast<double>(bucket) + 0.5) / kBucketsPerOctave) * 1e-9;
}

void fill(v1::StageTiming& timing, const char* name, const DurationHistogram& durations) {
  timing.set_name(name);
  timing.set_median_us(durations.quantile(0.5) * 1e6);
  timing.set_p99_us(durations.quantile(0.99) * 1e6);
  timing.set_max_us(durations.max() * 1e6);
}

void fill(v1::Audit& message, const AuditTotals& totals, const DurationHistogram& durations) {
  message.set_ticks(totals.ticks);
  message.set_pairs(totals.pairs);
  message.set_missed(totals.missed);
  message.set_extra(totals.extra);
  fill(*message.mutable_timing(), "audit", durations);
}

}  // namespace

void DurationHistogram::add(double seconds) {
  if (buckets_.empty()) buckets_.resize(kBuckets);
  ++buckets_[bucketOf(seconds)];
  ++count_;
  sum_ += seconds;
  max_ = std::max(max_, seconds);
}

double DurationHistogram::quantile(double fraction) const {
  if (count_ == 0) return 0;
  const auto rank = static_cast<std::uint64_t>(fraction * static_cast<double>(count_ - 1));
  std::uint64_t seen = 0;
  for (std::size_t i = 0; i < buckets_.size(); ++i) {
    seen += buckets_[i];
    if (seen > rank) return std::min(middleOf(i), max_);
  }
  return max_;
}

void TickStatistics::add(const scene::TickReport& report) {
  double whole = 0;
  for (std::size_t i = 0; i < scene::kStages; ++i) {
    stages_[i].add(report.stageSeconds[i]);
    whole += report.stageSeconds[i];
  }
  if (report.audit) {
    audit_.add(*report.audit);
    audited_.add(report.audit->seconds);
    whole += report.audit->seconds;
  }
  tick_.add(whole);
  for (const scene::ContactEvent& event : report.contacts) {
    if (event.kind == scene::ContactEvent::Kind::begin) ++contacts_;
  }
  narrowQueries_ += report.narrowQueries;
  rationalQueries_ += report.rationalQueries;
  squeezedBodies_ += report.squeezedBodies;
  pairs_ = report.pairs;
  liveContacts_ = report.liveContacts;
  avatars_ = static_cast<std::uint32_t>(report.snapshot->avatars.size());
  worstPenetration_ = std::max(worstPenetration_, report.worstPenetration);
}

v1::Metrics TickStatistics::metrics() const {
  v1::Metrics metrics;
  metrics.set_ticks(tick_.count());
  if (tick_.sum() > 0) {
    metrics.set_ticks_per_second(static_cast<double>(tick_.count()) / tick_.sum());
  }
  for (std::size_t i = 0; i < scene::kStages; ++i) {
    fill(*metrics.add_stages(), scene::kStageNames[i], stages_[i]);
  }
  fill(*metrics.mutable_tick(), "tick", tick_);
  metrics.set_pairs(pairs_);
  metrics.set_live_contacts(liveContacts_);
  metrics.set_contacts(contacts_);
  metrics.set_narrow_queries(narrowQueries_);
  metrics.set_rational_queries(rationalQueries_);
  metrics.set_worst_penetration(worstPenetration_);
  metrics.set_squeezed_bodies(squeezedBodies_);
  metrics.set_avatars(avatars_);
  if (audit_.ticks > 0) fill(*metrics.mutable_audit(), audit_, audited_);
  return metrics;
}

}  // namespace enfilade::server
