#include "render/gl/visibility_cache.hpp"

#include <algorithm>
#include <limits>

namespace enfilade::render {
namespace {

constexpr std::size_t kMostEntries = 256;
// Beyond these another view shows other things, and searching anew is quicker.
constexpr double kFarthest = 3.0;  // metres between the eyes
constexpr double kTurned = 0.5;    // cosine between the gazes
// A turn by one radian counts as much as a way of so many metres.
constexpr double kMetresPerTurn = 2.0;

/// Infinite where the one says nothing about the other.
double unlikeness(const Camera& a, const Camera& b) {
  constexpr double kUnlike = std::numeric_limits<double>::infinity();
  if (a.projection != b.projection) return kUnlike;
  const double way = (a.eye - b.eye).norm();
  const double cosine = a.forward.stableNormalized().dot(b.forward.stableNormalized());
  if (way > kFarthest || cosine < kTurned) return kUnlike;
  return way + kMetresPerTurn * (1 - cosine);
}

}  // namespace

const Seen* SeenMemory::find(const Camera& camera) const {
  const Seen* best = nullptr;
  double least = std::numeric_limits<double>::infinity();
  for (const Seen& entry : entries_) {
    const double d = unlikeness(entry.camera, camera);
    if (d < least) {
      least = d;
      best = &entry;
    }
  }
  return best;
}

Seen& SeenMemory::recall(const Camera& camera, std::uint64_t picture) {
  Seen* best = const_cast<Seen*>(find(camera));  // of this, which is not const
  if (!best) {
    if (entries_.size() < kMostEntries) {
      best = &entries_.emplace_back();
    } else {
      best = &*std::min_element(entries_.begin(), entries_.end(),
                                [](const Seen& a, const Seen& b) { return a.used < b.used; });
      *best = {};
    }
  }
  best->camera = camera;
  const std::uint64_t before = best->used;
  best->used = picture;
  if (before == 0) {
    best->parts.clear();
    best->avatars.clear();
  }
  return *best;
}

}  // namespace enfilade::render
