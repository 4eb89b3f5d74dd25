// A hierarchical depth buffer (N. Greene, M. Kass, G. Miller 1993, "Hierarchical Z-buffer
// visibility"), over the depth of a picture that was drawn, so that nothing is drawn twice. Levels
// are four times coarser, not twice: half as many, and a line of four floats is one load.
#include "render/gl/depth_pyramid.hpp"

#include <algorithm>

namespace enfilade::render {
namespace {

constexpr int kStep = 4;       // pixels of a level that one of the next stands for, a side
constexpr int kCoarsest = 8;   // no level is made above one that has no more, a side
constexpr int kFewTexels = 3;  // a side; below that a level is looked at as it is

}  // namespace

std::vector<float>& DepthPyramid::base(int width, int height) {
  levels_[0].width = width;
  levels_[0].height = height;
  levels_[0].farthest.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  return levels_[0].farthest;
}

void DepthPyramid::build() {
  used_ = 1;
  while (std::max(levels_[used_ - 1].width, levels_[used_ - 1].height) > kCoarsest) {
    if (levels_.size() == used_) levels_.emplace_back();
    const Level& fine = levels_[used_ - 1];
    Level& coarse = levels_[used_];
    coarse.width = (fine.width + kStep - 1) / kStep;
    coarse.height = (fine.height + kStep - 1) / kStep;
    coarse.farthest.assign(
        static_cast<std::size_t>(coarse.width) * static_cast<std::size_t>(coarse.height), 1.0f);
    const int whole = fine.width / kStep;  // texels of the coarse row that have all their columns
    for (int y = 0; y < fine.height; ++y) {
      const float* from =
          &fine.farthest[static_cast<std::size_t>(y) * static_cast<std::size_t>(fine.width)];
      float* to = &coarse.farthest[static_cast<std::size_t>(y / kStep) *
                                   static_cast<std::size_t>(coarse.width)];
      for (int x = 0; x < whole; ++x, from += kStep) {
        const float one = std::min(from[0], from[1]), other = std::min(from[2], from[3]);
        to[x] = std::min(to[x], std::min(one, other));
      }
      for (int x = whole * kStep; x < fine.width; ++x, ++from)
        to[whole] = std::min(to[whole], *from);
    }
    ++used_;
  }
}

bool DepthPyramid::hidesAt(std::size_t level, const PixelRect& rect, float depth) const {
  const Level& texels = levels_[level];
  int scale = 1;
  for (std::size_t i = 0; i < level; ++i) scale *= kStep;
  for (int y = rect.top / scale; y <= rect.bottom / scale; ++y) {
    const float* row =
        &texels.farthest[static_cast<std::size_t>(y) * static_cast<std::size_t>(texels.width)];
    for (int x = rect.left / scale; x <= rect.right / scale; ++x) {
      if (row[x] > depth) continue;
      if (level == 0) return false;
      const PixelRect inside{std::max(rect.left, x * scale), std::max(rect.top, y * scale),
                             std::min(rect.right, (x + 1) * scale - 1),
                             std::min(rect.bottom, (y + 1) * scale - 1)};
      if (!hidesAt(level - 1, inside, depth)) return false;
    }
  }
  return true;
}

bool DepthPyramid::hides(const PixelRect& rect, float depth) const {
  std::size_t level = 0;
  int size = std::max(rect.right - rect.left, rect.bottom - rect.top);
  for (; size > kFewTexels && level + 1 < used_; size /= kStep) ++level;
  return hidesAt(level, rect, depth);
}

}  // namespace enfilade::render
