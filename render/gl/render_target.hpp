// Framebuffers of several views of one size: sRGB colour, object ids, 32-bit depth, and optional
// normals and plane depth. Each view has a layer; a channel of all layers is read back at once.
#pragma once

#include <span>
#include <vector>

#include "render/ambient_occlusion.hpp"
#include "render/frame.hpp"
#include "render/gl/gl_objects.hpp"

namespace enfilade::render {

/// A range of layers.
struct Layers {
  int first = 0, count = 1;
};

/// Layers with their attachments; empty if default-constructed.
class RenderTarget {
 public:
  RenderTarget() = default;
  /// Needs a current context. Throws RenderError if the device rejects the size.
  RenderTarget(int width, int height, int layers);

  bool hasSize(int width, int height) const { return width == width_ && height == height_; }
  int layers() const { return static_cast<int>(framebuffers_.size()); }

  /// Binds a layer for the following calls and draws.
  void select(int layer);
  /// Clears the selected layer: colour black, id 0, normals 0, depth 0 (the farthest), plane depth
  /// NaN; enables `channels` and the plane depth. Throws RenderError if the device rejects the
  /// attachment of normals or plane depth.
  void begin(const Channels& channels, bool planeDepth);
  /// Enables drawing into these channels; the depth mask controls depth.
  void setDrawChannels(const Channels& channels, bool planeDepth = false) const;
  /// Sets the shadow mask of the following draws: 255 per sunlit pixel, 0 in shadow.
  void setShadowMask(const std::vector<std::uint8_t>& mask);

  // These read a channel of some layers, each with width * height pixels.
  void readColour(Layers layers, std::span<std::uint8_t> rgba) const;  ///< 4 values per pixel
  void readIds(Layers layers, std::span<std::uint32_t> ids) const;
  void readNormals(Layers layers, std::span<float> normals) const;  ///< 3 values per pixel
  /// Buffer depth: 1 near; 0 far and background.
  void readDepth(Layers layers, std::span<float> depth) const;
  /// Plane depth in metres; NaN for the background.
  void readPlaneDepth(Layers layers, std::span<float> metres) const;

 private:
  void attach(GlTextureArray& texture, unsigned format, unsigned attachment);
  unsigned framebuffer() const { return framebuffers_[static_cast<std::size_t>(layer_)].name(); }
  template <class Value>
  void read(const GlTextureArray& texture, Layers layers, unsigned format, unsigned type,
            std::span<Value> values) const;

  int width_ = 0, height_ = 0, layer_ = 0;
  GlTextureArray colour_, ids_, depth_, normals_, planeDepth_;  ///< with one layer per view
  GlTexture shadowMask_;
  std::vector<GlFramebuffer> framebuffers_;  ///< one per layer
};

/// Colour with ambient occlusion, which is attenuated by the alpha channel of `rgba`: it holds the
/// transmittance. sRGB, 3 bytes per pixel.
std::vector<std::uint8_t> applyOcclusion(std::span<const std::uint8_t> rgba, int width, int height,
                                         const AmbientOcclusion& ambientOcclusion);

/// Converts buffer depth to metres along forward; NaN for the background.
std::vector<float> convertDepthToMetres(const std::vector<float>& depth, const Camera& camera);

}  // namespace enfilade::render
