// What is drawn into: sRGB colour, object ids, 32-bit depth and, when somebody wants them, normals,
// all of one size; and reading them back.
#pragma once

#include "render/ambient_occlusion.hpp"
#include "render/frame.hpp"
#include "render/gl/gl_objects.hpp"

namespace enfilade::render {

class FrameTarget {
 public:
  FrameTarget() = default;
  /// Needs a current context. Throws RenderError when the device refuses the size.
  FrameTarget(int width, int height);

  bool fits(int width, int height) const { return width == width_ && height == height_; }
  /// Binds it, all black, id 0, normals 0 and depth 0 (the farthest); draws into `channels`. Throws
  /// RenderError when the device refuses normals.
  void begin(const Channels& channels);
  /// Draw into these channels; depth is written as the depth mask says.
  void drawInto(const Channels& channels) const;
  /// Which pixels surfaces are lit by the sun in from now on: 255, or 0 in shadow.
  void lightBy(const std::vector<std::uint8_t>& sunlit);
  /// The channels but depth and colour into `frame`.
  void read(Frame& frame, const Channels& channels) const;
  /// The colour, darkened by `hollows` as far as its alpha lets them be seen.
  void readColour(Frame& frame, const Hollows& hollows);
  /// As it is in the buffer: 1 near, 0 far and nothing.
  void readDepth(std::vector<float>& depth) const;

 private:
  void addNormals();

  int width_ = 0, height_ = 0;
  GlTexture colour_, ids_, depth_, normals_, sunlit_;
  std::vector<std::uint8_t> rgba_;  ///< kept for reading back
  GlFramebuffer framebuffer_;
};

/// From the buffer's depth to metres along forward; NaN where nothing is.
std::vector<float> metresOf(const std::vector<float>& depth, const Camera& camera);

}  // namespace enfilade::render
