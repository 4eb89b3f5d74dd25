// The framebuffer: sRGB colour, object ids, 32-bit depth and optional normals of one size, with
// readback.
#pragma once

#include "render/ambient_occlusion.hpp"
#include "render/frame.hpp"
#include "render/gl/gl_objects.hpp"

namespace enfilade::render {

/// Framebuffer with its attachments; empty if default-constructed.
class RenderTarget {
 public:
  RenderTarget() = default;
  /// Needs a current context. Throws RenderError if the device rejects the size.
  RenderTarget(int width, int height);

  bool hasSize(int width, int height) const { return width == width_ && height == height_; }
  /// Binds and clears it: colour black, id 0, normals 0, depth 0 (the farthest), plane depth NaN;
  /// enables `channels` and the plane depth. Throws RenderError if the device rejects the
  /// attachment of normals or plane depth.
  void begin(const Channels& channels, bool planeDepth);
  /// Enables drawing into these channels; the depth mask controls depth.
  void setDrawChannels(const Channels& channels, bool planeDepth = false) const;
  /// Sets the shadow mask of the following draws: 255 per sunlit pixel, 0 in shadow.
  void setShadowMask(const std::vector<std::uint8_t>& mask);
  /// Reads ids and normals, if requested, into `frame`.
  void readChannels(Frame& frame, const Channels& channels) const;
  /// Reads the colour and applies the ambient occlusion, attenuated by the alpha channel, which
  /// holds the transmittance.
  void readColour(Frame& frame, const AmbientOcclusion& ambientOcclusion);
  /// Reads the buffer depth: 1 near; 0 far and background.
  void readDepth(std::vector<float>& depth) const;
  /// Reads the plane depth in metres; NaN for the background.
  void readPlaneDepth(std::vector<float>& metres) const;

 private:
  void addAttachment(GlTexture& texture, unsigned format, unsigned attachment);

  int width_ = 0, height_ = 0;
  GlTexture colour_, ids_, depth_, normals_, planeDepth_, shadowMask_;
  std::vector<std::uint8_t> rgba_;  ///< readback buffer
  GlFramebuffer framebuffer_;
};

/// Converts buffer depth to metres along forward; NaN for the background.
std::vector<float> convertDepthToMetres(const std::vector<float>& depth, const Camera& camera);

}  // namespace enfilade::render
