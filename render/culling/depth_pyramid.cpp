// A hierarchical depth buffer (N. Greene, M. Kass, G. Miller 1993, "Hierarchical Z-buffer
// visibility") built from a rendered depth buffer. Levels are four times coarser instead of twice:
// half as many levels, and four adjacent floats are one load.
#include "render/culling/depth_pyramid.hpp"

#include <algorithm>

#include "collision/assert.hpp"

namespace enfilade::render {
namespace {

constexpr int kReductionFactor = 4;  // reduction per level and axis
constexpr int kMinLevelSize = 8;     // texels per axis of the coarsest level
constexpr int kSmallRectThreshold =
    3;  // per axis; smaller rectangles are tested on the current level

}  // namespace

std::vector<float>& DepthPyramid::baseLevel(int width, int height) {
  ENFILADE_ASSERT(width > 0 && height > 0);
  levels_[0].width = width;
  levels_[0].height = height;
  levels_[0].farthestDepth.resize(static_cast<std::size_t>(width) *
                                  static_cast<std::size_t>(height));
  return levels_[0].farthestDepth;
}

void DepthPyramid::build() {
  ENFILADE_ASSERT(!levels_[0].farthestDepth.empty());
  levelCount_ = 1;
  while (std::max(levels_[levelCount_ - 1].width, levels_[levelCount_ - 1].height) >
         kMinLevelSize) {
    if (levels_.size() == levelCount_) levels_.emplace_back();
    const Level& fine = levels_[levelCount_ - 1];
    Level& coarse = levels_[levelCount_];
    coarse.width = (fine.width + kReductionFactor - 1) / kReductionFactor;
    coarse.height = (fine.height + kReductionFactor - 1) / kReductionFactor;
    coarse.farthestDepth.assign(
        static_cast<std::size_t>(coarse.width) * static_cast<std::size_t>(coarse.height), 1.0f);
    const int whole = fine.width / kReductionFactor;  // texels of the coarse row with all columns
    for (int y = 0; y < fine.height; ++y) {
      const float* from =
          &fine.farthestDepth[static_cast<std::size_t>(y) * static_cast<std::size_t>(fine.width)];
      float* to = &coarse.farthestDepth[static_cast<std::size_t>(y / kReductionFactor) *
                                        static_cast<std::size_t>(coarse.width)];
      for (int x = 0; x < whole; ++x, from += kReductionFactor) {
        const float one = std::min(from[0], from[1]), other = std::min(from[2], from[3]);
        to[x] = std::min(to[x], std::min(one, other));
      }
      for (int x = whole * kReductionFactor; x < fine.width; ++x, ++from)
        to[whole] = std::min(to[whole], *from);
    }
    ++levelCount_;
  }
}

bool DepthPyramid::isOccludedAt(std::size_t level, const PixelRect& rect, float depth) const {
  const Level& texels = levels_[level];
  int scale = 1;
  for (std::size_t i = 0; i < level; ++i) scale *= kReductionFactor;
  for (int y = rect.top / scale; y <= rect.bottom / scale; ++y) {
    const float* row =
        &texels.farthestDepth[static_cast<std::size_t>(y) * static_cast<std::size_t>(texels.width)];
    for (int x = rect.left / scale; x <= rect.right / scale; ++x) {
      if (row[x] > depth) continue;
      if (level == 0) return false;
      const PixelRect inside{std::max(rect.left, x * scale), std::max(rect.top, y * scale),
                             std::min(rect.right, (x + 1) * scale - 1),
                             std::min(rect.bottom, (y + 1) * scale - 1)};
      if (!isOccludedAt(level - 1, inside, depth)) return false;
    }
  }
  return true;
}

bool DepthPyramid::isOccluded(const PixelRect& rect, float depth) const {
  ENFILADE_ASSERT(0 <= rect.left && rect.left <= rect.right && rect.right < width());
  ENFILADE_ASSERT(0 <= rect.top && rect.top <= rect.bottom && rect.bottom < height());
  std::size_t level = 0;
  int size = std::max(rect.right - rect.left, rect.bottom - rect.top);
  for (; size > kSmallRectThreshold && level + 1 < levelCount_; size /= kReductionFactor) ++level;
  return isOccludedAt(level, rect, depth);
}

}  // namespace enfilade::render
