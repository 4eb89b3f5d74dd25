// Mipmapped textures with GL's trilinear filtering: repeated, decoded from sRGB to linear.
#pragma once

#include <array>
#include <memory>
#include <mutex>
#include <vector>

#include "scene/model/model.hpp"

namespace enfilade::render {

/// Linear RGBA, 0..1.
using Texel = std::array<float, 4>;

/// A texture and its mipmap levels.
class MipTexture {
 public:
  /// Refers to `texture`, whose pixels are the finest level. A texture without pixels is white; the
  /// importer has already reported missing textures.
  explicit MipTexture(const scene::Texture& texture);

  /// Trilinear sample. (0, 0) is the top left; `level` counts halvings, clamped to the levels.
  Texel sample(float u, float v, float level) const;
  /// Size of the finest level in pixels.
  std::uint32_t width() const { return levels_.front().width; }
  std::uint32_t height() const { return levels_.front().height; }

 private:
  struct Level {
    std::uint32_t width, height;
    const std::uint8_t* rgba;
  };
  static Texel bilinear(const Level& level, float u, float v);
  void addCoarser();

  std::vector<std::vector<std::uint8_t>> coarserPixels_;
  std::vector<Level> levels_;
};

/// The textures of a model, created on first use. Thread-safe.
class MipTextures {
 public:
  explicit MipTextures(const scene::Model& model);
  const MipTexture& operator[](std::size_t index) const;

 private:
  struct Slot {
    std::once_flag once;
    std::unique_ptr<MipTexture> texture;
  };
  const scene::Model& model_;
  std::unique_ptr<Slot[]> slots_;
};

/// Encodes 0..1 by a table; the error is at most one step of the byte.
std::uint8_t linearToSrgbByteByTable(float value);

}  // namespace enfilade::render
