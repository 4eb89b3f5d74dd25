// VisibilityCache: visible items of earlier frames by camera, the first guess for the next frame.
#pragma once

#include <cstdint>
#include <deque>
#include <vector>

#include "render/camera/camera.hpp"

namespace enfilade::render {

/// The visible items of one earlier camera.
struct CachedView {
  Camera camera;
  std::vector<std::uint32_t> items;      ///< possibly visible; ascending
  std::vector<scene::EntityId> avatars;  ///< possibly visible; ascending
  std::uint64_t updates = 0;             ///< so far
  std::uint64_t lastUsed = 0;            ///< frame number of the last use; 0: never
};

/// Affects only rendering time, never the frame. With many cameras per tick, each finds its own
/// entry or that of a similar camera.
class VisibilityCache {
 public:
  /// The most similar view, to be updated for `camera`; empty if no view is similar enough.
  /// `frameNumber` is larger than in the calls before. The reference stays valid; the least
  /// recently used of many views is replaced.
  CachedView& lookup(const Camera& camera, std::uint64_t frameNumber);
  /// The most similar view; null if no view is similar enough.
  const CachedView* findNearest(const Camera& camera) const;

 private:
  std::deque<CachedView> entries_;
};

}  // namespace enfilade::render
