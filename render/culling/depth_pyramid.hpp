// Hierarchical depth buffer for occlusion tests. Independent of OpenGL.
#pragma once

#include <vector>

namespace enfilade::render {

/// A pixel rectangle inside the image.
struct PixelRect {
  int left, top, right, bottom;  ///< inclusive
};

/// A frame's buffer depth (reversed: 1 near; 0 far and background), and the farthest depth of each
/// square of 4, 16, 64, ... pixels.
class DepthPyramid {
 public:
  /// The base level, to be filled row by row with a frame's depth; then call build().
  std::vector<float>& baseLevel(int width, int height);
  void build();

  /// True only if every pixel of the rectangle is nearer than `depth`.
  bool isOccluded(const PixelRect& rect, float depth) const;

  int width() const { return levels_.front().width; }
  int height() const { return levels_.front().height; }

 private:
  struct Level {
    int width = 0, height = 0;
    std::vector<float> farthestDepth;
  };
  bool isOccludedAt(std::size_t level, const PixelRect& rect, float depth) const;

  std::vector<Level> levels_ = std::vector<Level>(1);  ///< [0] is the base level
  std::size_t levelCount_ = 1;                         ///< levels of the current frame
};

}  // namespace enfilade::render
