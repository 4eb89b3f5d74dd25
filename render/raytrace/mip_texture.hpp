// Textures as GL's trilinear filter reads them: repeated, decoded from sRGB to linear.
#pragma once

#include <array>
#include <memory>
#include <mutex>
#include <vector>

#include "scene/model/model.hpp"

namespace enfilade::render {

/// Linear RGBA, 0..1.
using Texel = std::array<float, 4>;

class MipTexture {
 public:
  /// A texture without pixels is white: the importer has told of what is missing. Refers to
  /// `texture`, whose pixels are the finest level.
  explicit MipTexture(const scene::Texture& texture);

  /// (0, 0) is the top left; `level` in halvings of the size, clamped to what there is.
  Texel at(float u, float v, float level) const;
  /// Pixels, of the finest level.
  std::uint32_t width() const { return levels_.front().width; }
  std::uint32_t height() const { return levels_.front().height; }

 private:
  struct Level {
    std::uint32_t width, height;
    const std::uint8_t* rgba;
  };
  static Texel bilinear(const Level& level, float u, float v);
  void addCoarser();

  std::vector<std::vector<std::uint8_t>> kept_;
  std::vector<Level> levels_;
};

/// The textures of a model, each made when somebody first asks, from any thread.
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

/// 0..1 to 0..1.
float linearOfSrgb(std::uint8_t value);
std::uint8_t srgbOfLinear(float value);

}  // namespace enfilade::render
