#include "scene/import/file/decode_image.hpp"

#include <jpeglib.h>
#include <png.h>
#include <webp/decode.h>

#include <algorithm>
#include <array>
#include <csetjmp>
#include <cstdio>
#include <cstring>

namespace enfilade::scene {
namespace {

constexpr std::uint32_t kMaxReadableSide = 32768;  // pixels; a longer side is a broken header

bool startsWith(std::span<const std::byte> bytes, std::span<const unsigned char> magic) {
  return bytes.size() >= magic.size() && std::memcmp(bytes.data(), magic.data(), magic.size()) == 0;
}

std::variant<Texture, std::string> decodePng(std::span<const std::byte> bytes) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_memory(&image, bytes.data(), bytes.size()) == 0) {
    return std::string("PNG: ") + image.message;
  }
  if (image.width > kMaxReadableSide || image.height > kMaxReadableSide) {
    png_image_free(&image);
    return std::string("PNG: too large");
  }
  image.format = PNG_FORMAT_RGBA;
  Texture texture;
  texture.width = image.width;
  texture.height = image.height;
  texture.rgba.resize(std::size_t{image.width} * image.height * 4);
  const int done = png_image_finish_read(&image, nullptr, texture.rgba.data(), 0, nullptr);
  if (done == 0) {
    png_image_free(&image);
    return std::string("PNG: ") + image.message;
  }
  return texture;
}

struct JpegErrors {
  jpeg_error_mgr base;  // first, so that a pointer to it is a pointer to this
  std::jmp_buf escape;
  std::array<char, JMSG_LENGTH_MAX> message;
};

[[noreturn]] void jumpOutOfJpeg(j_common_ptr info) {
  auto* errors = reinterpret_cast<JpegErrors*>(info->err);
  info->err->format_message(info, errors->message.data());
  std::longjmp(errors->escape, 1);
}

void ignoreJpegMessage(j_common_ptr, int) {}

/// Returns libjpeg's smallest reduction that fits; the caller halves the rest.
unsigned computeJpegReduction(const jpeg_decompress_struct& info, std::uint32_t longestSide) {
  unsigned reduction = 1;
  while (reduction < 8 && std::max(info.image_width, info.image_height) > longestSide * reduction) {
    reduction *= 2;
  }
  return reduction;
}

/// Decodes into `texture`. libjpeg reports errors by longjmp, so this function may not own an
/// object with a destructor.
bool readJpeg(std::span<const std::byte> bytes, std::uint32_t longestSide,
              jpeg_decompress_struct& info, JpegErrors& errors, Texture& texture) {
  if (setjmp(errors.escape) != 0) return false;
  jpeg_create_decompress(&info);
  jpeg_mem_src(&info, reinterpret_cast<const unsigned char*>(bytes.data()),
               static_cast<unsigned long>(bytes.size()));
  jpeg_read_header(&info, TRUE);
  info.out_color_space = JCS_EXT_RGBA;
  info.scale_num = 1;
  info.scale_denom = computeJpegReduction(info, longestSide);
  jpeg_start_decompress(&info);
  texture.width = info.output_width;
  texture.height = info.output_height;
  texture.rgba.resize(std::size_t{texture.width} * texture.height * 4);
  while (info.output_scanline < info.output_height) {
    JSAMPROW row = texture.rgba.data() + std::size_t{info.output_scanline} * texture.width * 4;
    jpeg_read_scanlines(&info, &row, 1);
  }
  jpeg_finish_decompress(&info);
  return true;
}

std::variant<Texture, std::string> decodeJpeg(std::span<const std::byte> bytes,
                                              std::uint32_t longestSide) {
  jpeg_decompress_struct info{};
  JpegErrors errors{};
  info.err = jpeg_std_error(&errors.base);
  errors.base.error_exit = jumpOutOfJpeg;
  errors.base.emit_message = ignoreJpegMessage;
  Texture texture;
  const bool done = readJpeg(bytes, longestSide, info, errors, texture);
  jpeg_destroy_decompress(&info);
  if (!done) return std::string("JPEG: ") + errors.message.data();
  return texture;
}

/// A WebP file: "RIFF", its size, "WEBP".
bool isWebp(std::span<const std::byte> bytes) {
  return bytes.size() >= 12 && std::memcmp(bytes.data(), "RIFF", 4) == 0 &&
         std::memcmp(bytes.data() + 8, "WEBP", 4) == 0;
}

std::variant<Texture, std::string> decodeWebp(std::span<const std::byte> bytes) {
  const auto* data = reinterpret_cast<const std::uint8_t*>(bytes.data());
  int width = 0, height = 0;  // the format allows 16383
  if (WebPGetInfo(data, bytes.size(), &width, &height) == 0) return std::string("WebP: damaged");
  Texture texture;
  texture.width = static_cast<std::uint32_t>(width);
  texture.height = static_cast<std::uint32_t>(height);
  texture.rgba.resize(std::size_t{texture.width} * texture.height * 4);
  if (WebPDecodeRGBAInto(data, bytes.size(), texture.rgba.data(), texture.rgba.size(), width * 4) ==
      nullptr)
    return std::string("WebP: damaged or animated");
  return texture;
}

}  // namespace

void halveTexture(Texture& texture) {
  const std::uint32_t width = std::max(1u, texture.width / 2);
  const std::uint32_t height = std::max(1u, texture.height / 2);
  std::vector<std::uint8_t> half(std::size_t{width} * height * 4);
  const auto at = [&](std::uint32_t x, std::uint32_t y, std::size_t channel) -> unsigned {
    x = std::min(x, texture.width - 1);
    y = std::min(y, texture.height - 1);
    return texture.rgba[(std::size_t{y} * texture.width + x) * 4 + channel];
  };
  for (std::uint32_t y = 0; y < height; ++y) {
    for (std::uint32_t x = 0; x < width; ++x) {
      for (std::size_t c = 0; c < 4; ++c) {
        const unsigned sum = at(2 * x, 2 * y, c) + at(2 * x + 1, 2 * y, c) +
                             at(2 * x, 2 * y + 1, c) + at(2 * x + 1, 2 * y + 1, c);
        half[(std::size_t{y} * width + x) * 4 + c] = static_cast<std::uint8_t>((sum + 2) / 4);
      }
    }
  }
  texture.width = width;
  texture.height = height;
  texture.rgba = std::move(half);
}

std::variant<Texture, std::string> decodeImage(std::span<const std::byte> bytes,
                                               std::uint32_t maxSide) {
  static constexpr std::array<unsigned char, 4> kPng{0x89, 'P', 'N', 'G'};
  static constexpr std::array<unsigned char, 3> kJpeg{0xff, 0xd8, 0xff};
  std::variant<Texture, std::string> image = std::string("neither PNG, JPEG nor WebP");
  if (startsWith(bytes, kPng)) image = decodePng(bytes);
  if (startsWith(bytes, kJpeg)) image = decodeJpeg(bytes, maxSide);
  if (isWebp(bytes)) image = decodeWebp(bytes);
  if (auto* texture = std::get_if<Texture>(&image)) {
    while (std::max(texture->width, texture->height) > std::max(1u, maxSide))
      halveTexture(*texture);
  }
  return image;
}

}  // namespace enfilade::scene
