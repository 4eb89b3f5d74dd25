// What a picture's depth hides. Knows no GL.
#pragma once

#include <vector>

namespace enfilade::render {

/// Pixels first..last of both axes, all inside the picture.
struct PixelRect {
  int left, top, right, bottom;  ///< inclusive
};

/// A picture's depth as it is in the buffer (reversed: 1 near, 0 far and nothing), and of each
/// square of 4, 16, 64, ... pixels the farthest depth in it.
class DepthPyramid {
 public:
  /// Where to put the depth of a picture of this size, row by row; then call build().
  std::vector<float>& base(int width, int height);
  void build();

  /// True only when each pixel of the rectangle is nearer than `depth`.
  bool hides(const PixelRect& rect, float depth) const;

  int width() const { return levels_.front().width; }
  int height() const { return levels_.front().height; }

 private:
  struct Level {
    int width = 0, height = 0;
    std::vector<float> farthest;
  };
  bool hidesAt(std::size_t level, const PixelRect& rect, float depth) const;

  std::vector<Level> levels_ = std::vector<Level>(1);  ///< [0] is the picture
  std::size_t used_ = 1;                               ///< levels of this picture
};

}  // namespace enfilade::render
