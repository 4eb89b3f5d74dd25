#include "render/image/encode.hpp"

#include <gtest/gtest.h>
#include <png.h>
#include <turbojpeg.h>
#include <zstd.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <vector>

#include "render/image/image.hpp"

namespace enfilade::render {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

template <class Value>
std::vector<Value> makeNoise(std::size_t count) {
  std::mt19937 random(5);
  std::vector<Value> values(count);
  for (Value& value : values) value = static_cast<Value>(random());
  return values;
}

struct Grey16 {
  unsigned width = 0, height = 0;
  int bits = 0, channels = 0;
  std::vector<std::uint16_t> values;
};

/// Decodes with libpng as stored in the file: no gamma, no conversion.
Grey16 readPng16(const Bytes& file) {
  struct Source {
    const Bytes& bytes;
    std::size_t at = 0;
  } source{file};
  png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_set_read_fn(png, &source, [](png_structp reader, png_bytep into, std::size_t count) {
    auto& from = *static_cast<Source*>(png_get_io_ptr(reader));
    std::memcpy(into, from.bytes.data() + from.at, count);
    from.at += count;
  });
  png_read_png(png, info, PNG_TRANSFORM_SWAP_ENDIAN, nullptr);
  Grey16 picture{png_get_image_width(png, info),
                 png_get_image_height(png, info),
                 png_get_bit_depth(png, info),
                 png_get_channels(png, info),
                 {}};
  for (unsigned y = 0; y < picture.height; ++y) {
    const png_bytep row = png_get_rows(png, info)[y];
    for (unsigned x = 0; x < picture.width * static_cast<unsigned>(picture.channels); ++x) {
      std::uint16_t value = 0;
      std::memcpy(&value, row + 2 * x, 2);
      picture.values.push_back(value);
    }
  }
  png_destroy_read_struct(&png, &info, nullptr);
  return picture;
}

TEST(EncodePng, SixteenBitsComeBackAsTheyWere) {
  const auto values = makeNoise<std::uint16_t>(13 * 7);
  const Grey16 back = readPng16(encodePng(Raster<std::uint16_t>{13, 7, 1, values}));
  EXPECT_EQ(back.width, 13U);
  EXPECT_EQ(back.height, 7U);
  EXPECT_EQ(back.bits, 16);
  EXPECT_EQ(back.channels, 1);
  EXPECT_EQ(back.values, values);
}

TEST(EncodePng, GreyIsReadAsEqualColours) {
  const std::vector<std::uint8_t> values{0, 90, 255, 7, 8, 9};
  const Image back = decodePng(encodePng(Raster<std::uint8_t>{3, 2, 1, values}));
  ASSERT_EQ(back.rgb.size(), 18U);
  for (std::size_t i = 0; i < 18; ++i) EXPECT_EQ(back.rgb[i], values[i / 3]);
}

TEST(EncodePng, AlphaIsStoredAsItIs) {
  const std::vector<std::uint8_t> values{10, 20, 30, 255, 40, 50, 60, 0};
  const Bytes png = encodePng(Raster<std::uint8_t>{2, 1, 4, values});
  EXPECT_EQ(png.at(25), PNG_COLOR_TYPE_RGB_ALPHA) << "PNG, 11.2.2: the colour type";
  const Image back = decodePng(png);
  ASSERT_EQ(back.rgb.size(), 6U);
  EXPECT_EQ(back.rgb[1], 20);
  EXPECT_THROW(encodeJpeg({2, 1, 4, values}, 90), std::runtime_error) << "JPEG has no alpha";
}

TEST(Encode, ValuesThatDoNotFillThePictureAreRefused) {
  const std::vector<std::uint8_t> bytes(12);
  const std::vector<std::uint16_t> words(12);
  const std::vector<float> floats(12);
  EXPECT_THROW(encodePng(Raster<std::uint8_t>{4, 4, 1, bytes}), std::runtime_error);
  EXPECT_THROW(encodePng(Raster<std::uint8_t>{6, 1, 2, bytes}), std::runtime_error);
  EXPECT_THROW(encodePng(Raster<std::uint16_t>{0, 12, 1, words}), std::runtime_error);
  EXPECT_THROW(encodeJpeg({2, 3, 3, bytes}, 90), std::runtime_error);
  EXPECT_THROW(encodeNpy(Raster<float>{13, 1, 1, floats}), std::runtime_error);
  EXPECT_THROW(packDepth({-3, -4, 1, words}), std::runtime_error);
  EXPECT_THROW(packDepth({2, 2, 3, words}), std::runtime_error);
}

TEST(EncodeJpeg, APictureComesBackNearlyAndBetterQualityIsNearer) {
  std::vector<std::uint8_t> values;
  for (int y = 0; y < 48; ++y) {
    for (int x = 0; x < 64; ++x) {
      for (const int value : {4 * x, 5 * y, 2 * x + y}) {
        values.push_back(static_cast<std::uint8_t>(value));
      }
    }
  }
  const auto worstAt = [&](int quality) {
    const Bytes file = encodeJpeg({64, 48, 3, values}, quality);
    std::vector<std::uint8_t> back(values.size());
    tjhandle reader = tjInitDecompress();
    EXPECT_EQ(tjDecompress2(reader, file.data(), file.size(), back.data(), 64, 0, 48, TJPF_RGB, 0),
              0);
    tjDestroy(reader);
    int worst = 0;
    for (std::size_t i = 0; i < back.size(); ++i)
      worst = std::max(worst, std::abs(back[i] - values[i]));
    return worst;
  };
  EXPECT_LT(worstAt(95), 12);
  EXPECT_LT(worstAt(95), worstAt(10));
  EXPECT_THROW(encodeJpeg({64, 48, 3, values}, 0), std::runtime_error);
  EXPECT_THROW(encodeJpeg({64, 48, 3, values}, 101), std::runtime_error);
}

TEST(EncodeNpy, HeaderAndValuesAreThoseOfTheFormat) {
  const std::vector<float> values{1.5f, kNan, -2, 0, 3, 4};
  const Bytes file = encodeNpy(Raster<float>{3, 2, 1, values});
  const std::string start(file.begin(), file.begin() + 6);
  EXPECT_EQ(start, "\x93NUMPY");
  const std::size_t length = file[8] + 256U * file[9];
  EXPECT_EQ((10 + length) % 64, 0U);
  const std::string header(file.begin() + 10, file.begin() + 10 + static_cast<long>(length));
  EXPECT_EQ(header.substr(0, header.find_last_of('}') + 1),
            "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }");
  EXPECT_EQ(header.back(), '\n');
  ASSERT_EQ(file.size(), 10 + length + 24);
  EXPECT_EQ(std::memcmp(file.data() + 10 + length, values.data(), 24), 0);
}

TEST(EncodeNpy, ThreeChannelsAreAThirdAxis) {
  const auto colour = makeNoise<std::uint8_t>(30);
  const Bytes file = encodeNpy(Raster<std::uint8_t>{5, 2, 3, colour});
  EXPECT_NE(std::string(file.begin(), file.end())
                .find("'|u1', 'fortran_order': False, 'shape': "
                      "(2, 5, 3)"),
            std::string::npos);
}

TEST(Depth16, NothingIsZeroAndASurfaceNeverIs) {
  const std::vector<float> metres{
      kNan, 0.0001f, 0.0016f, 1, 65.535f, 65.6f, std::numeric_limits<float>::infinity()};
  const Depth16 depth = quantizeDepth(metres, 1000);
  EXPECT_EQ(depth.steps, (std::vector<std::uint16_t>{0, 1, 2, 1000, 65535, 65535, 65535}));
  EXPECT_EQ(depth.clampedPixels, 2U);
  EXPECT_THROW(quantizeDepth(metres, 0), std::runtime_error);
}

/// Inverse of packDepth(); empty if the bytes do not decompress to this size.
std::vector<std::uint16_t> unpackDepth(const Bytes& packed, std::size_t width, std::size_t height) {
  const std::size_t count = width * height;
  Bytes planes(2 * count);
  if (ZSTD_decompress(planes.data(), planes.size(), packed.data(), packed.size()) != planes.size())
    return {};
  std::vector<std::uint16_t> steps(count);
  for (std::size_t i = 0; i < count; ++i) {
    const unsigned last = i == 0 ? 0U : steps[i % width != 0 ? i - 1 : i - width];
    const unsigned change = planes[i] + 256U * planes[count + i];
    steps[i] = static_cast<std::uint16_t>((last + change) & 65535U);
  }
  return steps;
}

TEST(PackDepth, EveryValueComesBackAndSmoothDepthIsSmall) {
  const auto rough = makeNoise<std::uint16_t>(31 * 17);
  EXPECT_EQ(unpackDepth(packDepth({31, 17, 1, rough}), 31, 17), rough);
  std::vector<std::uint16_t> smooth;
  for (unsigned i = 0; i < 640 * 480; ++i)
    smooth.push_back(static_cast<std::uint16_t>(2000 + 3 * (i % 640) + i / 640));
  const Bytes packed = packDepth({640, 480, 1, smooth});
  EXPECT_EQ(unpackDepth(packed, 640, 480), smooth);
  EXPECT_LT(packed.size(), smooth.size() / 20);
}

}  // namespace
}  // namespace enfilade::render
