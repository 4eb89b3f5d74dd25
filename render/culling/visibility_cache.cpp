#include "render/culling/visibility_cache.hpp"

#include <algorithm>
#include <limits>

#include "collision/assert.hpp"

namespace enfilade::render {
namespace {

constexpr std::size_t kMaxEntries = 256;
// Beyond these limits, views share too little, and a new search is faster.
constexpr double kMaxEyeDistance = 3.0;  // metres between the eyes
constexpr double kMinViewCosine = 0.5;   // cosine between the view directions
// Weight of 1 - cosine between the view directions, in metres.
constexpr double kCosineWeight = 2.0;

/// Dissimilarity of two views in metres; infinite if they are unrelated.
double computeViewDistance(const Camera& a, const Camera& b) {
  constexpr double kIncomparable = std::numeric_limits<double>::infinity();
  if (a.projection != b.projection) return kIncomparable;
  const double distance = (a.eye - b.eye).norm();
  const double cosine = a.forward.stableNormalized().dot(b.forward.stableNormalized());
  if (distance > kMaxEyeDistance || cosine < kMinViewCosine) return kIncomparable;
  return distance + kCosineWeight * (1 - cosine);
}

}  // namespace

const CachedView* VisibilityCache::findNearest(const Camera& camera) const {
  const CachedView* best = nullptr;
  double minDistance = std::numeric_limits<double>::infinity();
  for (const CachedView& entry : entries_) {
    const double d = computeViewDistance(entry.camera, camera);
    if (d < minDistance) {
      minDistance = d;
      best = &entry;
    }
  }
  return best;
}

CachedView& VisibilityCache::lookup(const Camera& camera, std::uint64_t frameNumber) {
  ENFILADE_ASSERT(frameNumber > 0);
  // findNearest() is const; this object is not.
  CachedView* best = const_cast<CachedView*>(findNearest(camera));
  if (!best) {
    if (entries_.size() < kMaxEntries) {
      best = &entries_.emplace_back();
    } else {
      best = &*std::min_element(
          entries_.begin(), entries_.end(),
          [](const CachedView& a, const CachedView& b) { return a.lastUsed < b.lastUsed; });
      *best = {};
    }
  }
  best->camera = camera;
  const std::uint64_t before = best->lastUsed;
  best->lastUsed = frameNumber;
  if (before == 0) {
    best->items.clear();
    best->avatars.clear();
  }
  return *best;
}

}  // namespace enfilade::render
