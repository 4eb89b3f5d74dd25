#include "render/image/image.hpp"

#include <png.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "collision/assert.hpp"
#include "render/image/atomic_file.hpp"
#include "render/image/encode.hpp"
#include "scene/model/srgb.hpp"

namespace enfilade::render {
namespace {

constexpr std::uint64_t kMaxPixels = std::uint64_t{1} << 28;

std::size_t countPixels(const Image& image) {
  return static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
}

std::runtime_error makePngError(const char* call, const png_image& png) {
  return std::runtime_error(std::string(call) + " failed: " + png.message);
}

/// Source pixels that a target pixel covers on one axis; last excluded.
struct PixelSpan {
  int first, last;
};
PixelSpan computeCoveredSpan(int target, int targetSize, int sourceSize) {
  const auto edge = [&](int t) {
    return static_cast<int>(static_cast<std::int64_t>(t) * sourceSize / targetSize);
  };
  const int first = edge(target);
  return {first, std::max(edge(target + 1), first + 1)};
}

}  // namespace

Image toImage(const Frame& frame) {
  return {frame.camera.width, frame.camera.height, frame.rgb};
}

std::vector<std::uint8_t> encodePng(const Image& image) {
  return encodePng(Raster<std::uint8_t>{image.width, image.height, 3, image.rgb});
}

Image decodePng(const std::vector<std::uint8_t>& bytes) {
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  if (!png_image_begin_read_from_memory(&png, bytes.data(), bytes.size())) {
    throw makePngError("png_image_begin_read_from_memory", png);
  }
  if (std::uint64_t{png.width} * png.height > kMaxPixels) {
    png_image_free(&png);
    throw std::runtime_error("decodePng: the image has more than 2^28 pixels");
  }
  png.format = PNG_FORMAT_RGB;
  Image image{static_cast<int>(png.width), static_cast<int>(png.height), {}};
  image.rgb.resize(3 * countPixels(image));
  const png_color black{0, 0, 0};
  if (!png_image_finish_read(&png, &black, image.rgb.data(), 0, nullptr)) {
    throw makePngError("png_image_finish_read", png);
  }
  return image;
}

void writePng(const std::filesystem::path& file, const Image& image) {
  const std::vector<std::uint8_t> png = encodePng(image);
  writeFileAtomically(file, png.data(), png.size());
}

Image resizeImage(const Image& image, int width, int height) {
  ENFILADE_ASSERT(width >= 1 && height >= 1 && image.rgb.size() == 3 * countPixels(image));
  Image result{width, height, {}};
  result.rgb.reserve(3 * countPixels(result));
  for (int y = 0; y < height; ++y) {
    const PixelSpan rows = computeCoveredSpan(y, height, image.height);
    for (int x = 0; x < width; ++x) {
      const PixelSpan columns = computeCoveredSpan(x, width, image.width);
      std::array<float, 3> sum{};
      for (int v = rows.first; v < rows.last; ++v) {
        for (int u = columns.first; u < columns.last; ++u) {
          const std::size_t at =
              3 * (static_cast<std::size_t>(v) * static_cast<std::size_t>(image.width) +
                   static_cast<std::size_t>(u));
          for (std::size_t c = 0; c < 3; ++c) sum[c] += scene::srgbByteToLinear(image.rgb[at + c]);
        }
      }
      const auto count =
          static_cast<float>((rows.last - rows.first) * (columns.last - columns.first));
      for (const float s : sum) result.rgb.push_back(scene::linearToSrgbByte(s / count));
    }
  }
  return result;
}

}  // namespace enfilade::render
