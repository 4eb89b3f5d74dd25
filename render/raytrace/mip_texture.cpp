#include "render/raytrace/mip_texture.hpp"

#include <algorithm>
#include <cmath>

#include "collision/assert.hpp"
#include "scene/model/srgb.hpp"

namespace enfilade::render {
namespace {

constexpr std::uint8_t kWhite[4] = {255, 255, 255, 255};

/// sRGB bytes of evenly spaced linear values; the error is at most one byte step.
constexpr std::size_t kEncodedSteps = 1 << 14;
std::vector<std::uint8_t> makeEncodeTable() {
  std::vector<std::uint8_t> table(kEncodedSteps + 1);
  for (std::size_t i = 0; i <= kEncodedSteps; ++i)
    table[i] = scene::linearToSrgbByte(static_cast<double>(i) / kEncodedSteps);
  return table;
}

Texel decodeTexel(const std::uint8_t* rgba) {
  return {scene::srgbByteToLinear(rgba[0]), scene::srgbByteToLinear(rgba[1]),
          scene::srgbByteToLinear(rgba[2]), static_cast<float>(rgba[3]) / 255.0f};
}

Texel lerpTexel(const Texel& a, const Texel& b, float t) {
  Texel result;
  for (std::size_t c = 0; c < 4; ++c) result[c] = a[c] + t * (b[c] - a[c]);
  return result;
}

/// The two texels around a coordinate, with repeat, and the fraction between them.
struct Neighbours {
  std::size_t before, after;
  float fraction;
};

Neighbours findNeighbours(float u, std::uint32_t size) {
  const float x = (u - std::floor(u)) * static_cast<float>(size) - 0.5f;
  const float floor = std::floor(x);
  // From -1, at a texture's left border, to `size`, where u rounds up to 1.
  const auto index = static_cast<std::int64_t>(floor) + size;
  return {static_cast<std::size_t>(index % size), static_cast<std::size_t>((index + 1) % size),
          x - floor};
}

}  // namespace

std::uint8_t linearToSrgbByteByTable(float value) {
  static const std::vector<std::uint8_t> kTable = makeEncodeTable();
  const float bounded = value > 0 ? std::min(value, 1.0f) : 0.0f;  // a NaN is black
  return kTable[static_cast<std::size_t>(bounded * static_cast<float>(kEncodedSteps) + 0.5f)];
}

MipTexture::MipTexture(const scene::Texture& texture) {
  const bool usable = texture.width > 0 && texture.height > 0 &&
                      texture.rgba.size() == std::size_t{4} * texture.width * texture.height;
  levels_.push_back(usable ? Level{texture.width, texture.height, texture.rgba.data()}
                           : Level{1, 1, kWhite});
  while (levels_.back().width > 1 || levels_.back().height > 1) addCoarser();
}

void MipTexture::addCoarser() {
  const Level fine = levels_.back();
  const Level coarse{std::max(1u, fine.width / 2), std::max(1u, fine.height / 2), nullptr};
  std::vector<std::uint8_t> pixels(std::size_t{4} * coarse.width * coarse.height);
  for (std::uint32_t y = 0; y < coarse.height; ++y) {
    for (std::uint32_t x = 0; x < coarse.width; ++x) {
      // The centre of a coarse texel: the common corner of four fine ones if the size is even.
      const Texel mean =
          bilinear(fine, (static_cast<float>(x) + 0.5f) / static_cast<float>(coarse.width),
                   (static_cast<float>(y) + 0.5f) / static_cast<float>(coarse.height));
      std::uint8_t* out = &pixels[4 * (std::size_t{y} * coarse.width + x)];
      for (std::size_t c = 0; c < 3; ++c) out[c] = linearToSrgbByteByTable(mean[c]);
      out[3] = static_cast<std::uint8_t>(std::lround(255.0f * mean[3]));
    }
  }
  coarserPixels_.push_back(std::move(pixels));
  levels_.push_back({coarse.width, coarse.height, coarserPixels_.back().data()});
}

Texel MipTexture::bilinear(const Level& level, float u, float v) {
  const Neighbours x = findNeighbours(u, level.width), y = findNeighbours(v, level.height);
  const auto texel = [&](std::size_t column, std::size_t row) {
    return decodeTexel(level.rgba + 4 * (row * level.width + column));
  };
  return lerpTexel(lerpTexel(texel(x.before, y.before), texel(x.after, y.before), x.fraction),
                   lerpTexel(texel(x.before, y.after), texel(x.after, y.after), x.fraction),
                   y.fraction);
}

Texel MipTexture::sample(float u, float v, float level) const {
  if (!std::isfinite(u) || !std::isfinite(v)) return decodeTexel(levels_.front().rgba);
  const float last = static_cast<float>(levels_.size() - 1);
  const float wanted = level > 0 ? std::min(level, last) : 0.0f;  // a NaN becomes 0
  const auto fine = static_cast<std::size_t>(wanted);
  const float fraction = wanted - static_cast<float>(fine);
  const Texel fineSample = bilinear(levels_[fine], u, v);
  if (fraction <= 0) return fineSample;
  return lerpTexel(fineSample, bilinear(levels_[fine + 1], u, v), fraction);
}

MipTextures::MipTextures(const scene::Model& model)
    : model_(model), slots_(std::make_unique<Slot[]>(model.textures.size())) {}

const MipTexture& MipTextures::operator[](std::size_t index) const {
  ENFILADE_ASSERT(index < model_.textures.size());
  Slot& slot = slots_[index];
  std::call_once(slot.once,
                 [&] { slot.texture = std::make_unique<MipTexture>(model_.textures[index]); });
  return *slot.texture;
}

}  // namespace enfilade::render
