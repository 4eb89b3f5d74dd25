#include "render/image/encode.hpp"

#include <png.h>
#include <turbojpeg.h>
#include <zstd.h>

#include <bit>
#include <cmath>
#include <csetjmp>
#include <cstring>
#include <memory>
#include <stdexcept>
#include <string>

namespace enfilade::render {
namespace {

static_assert(std::endian::native == std::endian::little, "NPY and depth are little-endian");

constexpr int kPngLevel = 3;   // of zlib; higher levels take twice the time and save a few percent
constexpr int kZstdLevel = 3;  // the library's default
constexpr int kFullColourQuality = 90;
constexpr double kMaxDepthSteps = 65535;
constexpr std::size_t kNpyAlignment = 64;  // bytes, of the first value

template <class Value>
void validateRaster(const char* what, const Raster<Value>& pixels, bool mayHaveAlpha = false) {
  const bool shaped =
      pixels.width > 0 && pixels.height > 0 &&
      (pixels.channels == 1 || pixels.channels == 3 || (mayHaveAlpha && pixels.channels == 4));
  const std::size_t wanted = shaped ? static_cast<std::size_t>(pixels.width) *
                                          static_cast<std::size_t>(pixels.height) *
                                          static_cast<std::size_t>(pixels.channels)
                                    : 0;
  if (shaped && wanted == pixels.values.size()) return;
  throw std::runtime_error(std::string(what) + ": " + std::to_string(pixels.values.size()) +
                           " values are not an image of " + std::to_string(pixels.width) + "x" +
                           std::to_string(pixels.height) + " pixels with " +
                           std::to_string(pixels.channels) + " channels");
}

// ---- PNG ----------------------------------------------------------------------------------------

/// State of libpng's callbacks, which must not throw through C code.
struct PngSink {
  Bytes bytes;
  std::string failure;
  bool outOfMemory = false;
};

void appendPng(png_structp png, png_bytep data, std::size_t count) {
  auto& sink = *static_cast<PngSink*>(png_get_io_ptr(png));
  try {
    sink.bytes.insert(sink.bytes.end(), data, data + count);
  } catch (const std::bad_alloc&) {
    sink.outOfMemory = true;
  }
  if (sink.outOfMemory) png_error(png, "out of memory");
}

[[noreturn]] void failPng(png_structp png, png_const_charp text) {
  static_cast<PngSink*>(png_get_error_ptr(png))->failure = text;
  png_longjmp(png, 1);
}

void ignorePngWarning(png_structp, png_const_charp) {}

/// Contains all code between setjmp and longjmp; no object here has a destructor.
bool writePngRows(png_structp png, png_infop info, int width, int height, int bits, int channels,
                  const std::uint8_t* rows, std::size_t stride) {
  if (setjmp(png_jmpbuf(png)) != 0) return false;
  png_set_compression_level(png, kPngLevel);
  // 16-bit depth is smooth from row to row. For 8-bit colour, no filter is the fastest.
  png_set_filter(png, PNG_FILTER_TYPE_BASE, bits == 16 ? PNG_FILTER_UP : PNG_FILTER_NONE);
  png_set_IHDR(png, info, static_cast<png_uint_32>(width), static_cast<png_uint_32>(height), bits,
               channels == 4   ? PNG_COLOR_TYPE_RGB_ALPHA
               : channels == 3 ? PNG_COLOR_TYPE_RGB
                               : PNG_COLOR_TYPE_GRAY,
               PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  if (bits == 8 && channels >= 3) png_set_sRGB(png, info, PNG_sRGB_INTENT_PERCEPTUAL);
  png_write_info(png, info);
  if (bits == 16) png_set_swap(png);  // PNG is big-endian
  for (int y = 0; y < height; ++y) png_write_row(png, rows + static_cast<std::size_t>(y) * stride);
  png_write_end(png, info);
  return true;
}

Bytes encodePngBytes(int width, int height, int bits, int channels, const void* values) {
  PngSink sink;
  png_structp png =
      png_create_write_struct(PNG_LIBPNG_VER_STRING, &sink, failPng, ignorePngWarning);
  png_infop info = png ? png_create_info_struct(png) : nullptr;
  if (!info) {
    png_destroy_write_struct(&png, nullptr);
    throw std::runtime_error("encodePng: libpng failed: out of memory or version mismatch");
  }
  png_set_write_fn(png, &sink, appendPng, nullptr);
  const std::size_t stride = static_cast<std::size_t>(width) * static_cast<std::size_t>(channels) *
                             static_cast<std::size_t>(bits / 8);
  const bool done = writePngRows(png, info, width, height, bits, channels,
                                 static_cast<const std::uint8_t*>(values), stride);
  png_destroy_write_struct(&png, &info);
  if (!done) throw std::runtime_error("encodePng: libpng: " + sink.failure);
  return std::move(sink.bytes);
}

// ---- NPY ----------------------------------------------------------------------------------------

/// https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html, version 1.0.
template <class Value>
Bytes encodeNpyBytes(const Raster<Value>& pixels, const char* type) {
  validateRaster("encodeNpy", pixels);
  std::string header = "{'descr': '";
  header += type;
  header += "', 'fortran_order': False, 'shape': (" + std::to_string(pixels.height) + ", ";
  header += std::to_string(pixels.width) + (pixels.channels == 3 ? ", 3" : "") + "), }";
  constexpr std::size_t kBefore = 10;  // magic, version, length of the header
  while ((kBefore + header.size() + 1) % kNpyAlignment != 0) header += ' ';
  header += '\n';
  const std::size_t length = header.size();
  Bytes file{0x93,
             'N',
             'U',
             'M',
             'P',
             'Y',
             1,
             0,
             static_cast<std::uint8_t>(length & 255U),
             static_cast<std::uint8_t>(length >> 8U)};
  file.insert(file.end(), header.begin(), header.end());
  const std::size_t start = file.size();
  file.resize(start + pixels.values.size_bytes());
  std::memcpy(file.data() + start, pixels.values.data(), pixels.values.size_bytes());
  return file;
}

}  // namespace

Bytes encodePng(const Raster<std::uint8_t>& pixels) {
  validateRaster("encodePng", pixels, true);
  return encodePngBytes(pixels.width, pixels.height, 8, pixels.channels, pixels.values.data());
}

Bytes encodePng(const Raster<std::uint16_t>& pixels) {
  validateRaster("encodePng", pixels);
  return encodePngBytes(pixels.width, pixels.height, 16, pixels.channels, pixels.values.data());
}

Bytes encodeJpeg(const Raster<std::uint8_t>& pixels, int quality) {
  validateRaster("encodeJpeg", pixels);
  if (quality < 1 || quality > 100)
    throw std::runtime_error("encodeJpeg: quality " + std::to_string(quality) + " is not 1..100");
  const std::unique_ptr<void, int (*)(tjhandle)> compressor(tjInitCompress(), tjDestroy);
  if (!compressor) throw std::runtime_error(std::string("encodeJpeg: ") + tjGetErrorStr2(nullptr));
  const bool grey = pixels.channels == 1;
  const int sampling = grey ? TJSAMP_GRAY : quality >= kFullColourQuality ? TJSAMP_444 : TJSAMP_420;
  unsigned long bytes = tjBufSize(pixels.width, pixels.height, sampling);
  Bytes file(bytes);
  std::uint8_t* into = file.data();
  if (tjCompress2(compressor.get(), pixels.values.data(), pixels.width, 0, pixels.height,
                  grey ? TJPF_GRAY : TJPF_RGB, &into, &bytes, sampling, quality,
                  TJFLAG_NOREALLOC) != 0)
    throw std::runtime_error(std::string("encodeJpeg: ") + tjGetErrorStr2(compressor.get()));
  file.resize(bytes);
  return file;
}

Bytes encodeNpy(const Raster<float>& pixels) {
  return encodeNpyBytes(pixels, "<f4");
}
Bytes encodeNpy(const Raster<std::uint32_t>& pixels) {
  return encodeNpyBytes(pixels, "<u4");
}
Bytes encodeNpy(const Raster<std::uint16_t>& pixels) {
  return encodeNpyBytes(pixels, "<u2");
}
Bytes encodeNpy(const Raster<std::uint8_t>& pixels) {
  return encodeNpyBytes(pixels, "|u1");
}

// ---- depth --------------------------------------------------------------------------------------

Depth16 quantizeDepth(std::span<const float> metres, double stepsPerMetre) {
  if (!(stepsPerMetre > 0) || !std::isfinite(stepsPerMetre))
    throw std::runtime_error("invalid depth scale: " + std::to_string(stepsPerMetre) + " steps/m");
  Depth16 depth;
  depth.steps.reserve(metres.size());
  for (const float z : metres) {
    const double steps = std::round(static_cast<double>(z) * stepsPerMetre);
    if (steps > kMaxDepthSteps) ++depth.clampedPixels;
    const bool nothing = std::isnan(z);
    const double fitting = std::fmin(std::fmax(steps, 1), kMaxDepthSteps);
    depth.steps.push_back(nothing ? std::uint16_t{0} : static_cast<std::uint16_t>(fitting));
  }
  return depth;
}

Bytes packDepth(const Raster<std::uint16_t>& steps) {
  validateRaster("packDepth", steps);
  const auto width = static_cast<std::size_t>(steps.width);
  const std::size_t count = steps.values.size();
  if (steps.channels != 1) throw std::runtime_error("packDepth: depth has one channel, not 3");
  Bytes planes(2 * count);
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t before = i % width != 0 ? i - 1 : i - width;
    const unsigned last = i == 0 ? 0U : steps.values[before];
    const unsigned change = (steps.values[i] + 65536U - last) & 65535U;
    planes[i] = static_cast<std::uint8_t>(change & 255U);
    planes[count + i] = static_cast<std::uint8_t>(change >> 8U);
  }
  Bytes packed(ZSTD_compressBound(planes.size()));
  const std::size_t bytes =
      ZSTD_compress(packed.data(), packed.size(), planes.data(), planes.size(), kZstdLevel);
  if (ZSTD_isError(bytes) != 0)
    throw std::runtime_error(std::string("packDepth: zstd: ") + ZSTD_getErrorName(bytes));
  packed.resize(bytes);
  return packed;
}

}  // namespace enfilade::render
