#include "render/image/image.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <random>

#include "render/image/atomic_file.hpp"
#include "render/image/contact_sheet.hpp"
#include "render/image/drawing.hpp"
#include "render/image/font.hpp"
#include "tests/support/temporary_folder.hpp"

namespace enfilade::render {
namespace {

namespace fs = std::filesystem;

Image plain(int width, int height, std::uint8_t value = 0) {
  Image image{width, height, {}};
  image.rgb.assign(3 * static_cast<std::size_t>(width * height), value);
  return image;
}

int red(const Image& image, int x, int y) {
  return image.rgb[3 * static_cast<std::size_t>(y * image.width + x)];
}

long entriesIn(const tests::TemporaryFolder& folder) {
  return std::distance(fs::directory_iterator(folder.path()), {});
}

TEST(Png, RoundTripKeepsEveryByte) {
  std::mt19937 random(3);
  for (const auto& [width, height] : {std::pair(1, 1), std::pair(37, 5), std::pair(64, 64)}) {
    Image image = plain(width, height);
    for (auto& byte : image.rgb) byte = static_cast<std::uint8_t>(random() & 255u);
    const Image back = decodePng(encodePng(image));
    EXPECT_EQ(back.width, width);
    EXPECT_EQ(back.height, height);
    EXPECT_EQ(back.rgb, image.rgb);
  }
}

TEST(Png, BrokenBytesAndWrongSizesAreErrors) {
  std::vector<std::uint8_t> png = encodePng(plain(20, 20, 90));
  png.resize(png.size() / 2);
  EXPECT_THROW(decodePng(png), std::runtime_error);
  EXPECT_THROW(decodePng({}), std::runtime_error);
  Image wrong = plain(4, 4);
  wrong.width = 5;
  EXPECT_THROW(encodePng(wrong), std::runtime_error);
}

TEST(WriteFileWhole, ReplacesAFileAndLeavesNothingElse) {
  const tests::TemporaryFolder folder;
  const fs::path file = folder.path() / "a.bin";
  writeFileAtomically(file, "first", 5);
  writeFileAtomically(file, "second!", 7);
  std::ifstream in(file);
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(in), {}), "second!");
  EXPECT_EQ(entriesIn(folder), 1);
}

TEST(WriteFileWhole, APipeIsWrittenAndALinkFollowed) {
  const tests::TemporaryFolder folder;
  const fs::path pipe = folder.path() / "pipe", link = folder.path() / "link";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  const int reader = ::open(pipe.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  ASSERT_GE(reader, 0);
  writeFileAtomically(pipe, "whole", 5);
  char read[8] = {};
  EXPECT_EQ(::read(reader, read, sizeof read), 5);
  ::close(reader);
  EXPECT_STREQ(read, "whole");
  EXPECT_TRUE(fs::is_fifo(pipe));

  fs::create_symlink("file", link);
  writeFileAtomically(link, "first", 5);
  writeFileAtomically(link, "second", 6);
  EXPECT_TRUE(fs::is_symlink(link));
  EXPECT_EQ(fs::file_size(folder.path() / "file"), 6U);
  EXPECT_EQ(entriesIn(folder), 3);

  fs::create_symlink("circle", folder.path() / "circle");
  EXPECT_THROW(writeFileAtomically(folder.path() / "circle", "x", 1), std::runtime_error);
}

TEST(WriteFileWhole, AFailureNamesTheFileAndLeavesNoPart) {
  const tests::TemporaryFolder folder;
  const fs::path taken = folder.path() / "taken";
  fs::create_directories(taken / "inside");
  for (const fs::path& file : {taken, folder.path() / "missing" / "a.png"}) {
    try {
      writePng(file, plain(2, 2));
      ADD_FAILURE() << "written to " << file;
    } catch (const std::runtime_error& error) {
      EXPECT_NE(std::string(error.what()).find(file.string()), std::string::npos);
    }
  }
  EXPECT_EQ(entriesIn(folder), 1);
}

TEST(PendingFrame, TextDrawsItsLettersWhereTheyBelong) {
  Image image = plain(40, 20);
  drawText(image, 3, 4, "I.", 1, {255, 255, 255});
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const int letter = (x - 3) / kLetterAdvance, column = (x - 3) % kLetterAdvance;
      const bool within =
          x >= 3 && letter < 2 && column < kLetterWidth && y >= 4 && y < 4 + kLetterHeight;
      const bool ink = within && isLetterPixel(letter == 0 ? 'I' : '.', column, y - 4);
      EXPECT_EQ(red(image, x, y), ink ? 255 : 0) << x << ' ' << y;
    }
  }
}

TEST(PendingFrame, EveryLetterHasAShapeOfItsOwn) {
  std::vector<std::vector<bool>> shapes;
  for (char c = '!'; c <= '~'; ++c) {
    std::vector<bool> shape;
    for (int i = 0; i < kLetterWidth * kLetterHeight; ++i) {
      shape.push_back(isLetterPixel(c, i % kLetterWidth, i / kLetterWidth));
    }
    EXPECT_EQ(std::count(shapes.begin(), shapes.end(), shape), 0) << c;
    EXPECT_GT(std::count(shape.begin(), shape.end(), true), 1) << c;
    shapes.push_back(shape);
  }
  for (int i = 0; i < kLetterWidth * kLetterHeight; ++i) {
    EXPECT_FALSE(isLetterPixel(' ', i % kLetterWidth, i / kLetterWidth));
  }
}

TEST(PendingFrame, ADiscHasItsArea) {
  Image image = plain(60, 60);
  drawDisc(image, 30.3, 29.6, 12, {255, 255, 255});
  double area = 0;
  for (int i = 0; i < 3600; ++i) area += red(image, i % 60, i / 60) / 255.0;
  EXPECT_NEAR(area, 3.14159265 * 144, 5);
}

TEST(PendingFrame, ALineHasItsLengthTimesItsThicknessInEveryDirection) {
  for (int degrees = 0; degrees < 360; degrees += 15) {
    const double angle = degrees * 3.14159265358979 / 180;
    Image image = plain(120, 120);
    drawLine(image, 60, 60, 60 + 40 * std::cos(angle), 60 + 40 * std::sin(angle), 3,
             {255, 255, 255});
    double area = 0;
    for (int i = 0; i < 120 * 120; ++i) area += red(image, i % 120, i / 120) / 255.0;
    EXPECT_NEAR(area, 40 * 3 + 3.14159265 * 2.25, 6) << degrees;  // with its round caps
  }
}

TEST(PendingFrame, PointsOutsideAndNonFiniteOnesAreIgnored) {
  Image image = plain(10, 10, 7);
  const Image before = image;
  drawLine(image, -50, -50, -1e9, -20, 3, {255, 0, 0});
  drawLine(image, std::nan(""), 0, 5, 5, 3, {255, 0, 0});
  drawDisc(image, 100, 100, 3, {255, 0, 0});
  drawDisc(image, std::nan(""), 1, 3, {255, 0, 0});
  drawText(image, -100, -100, "text", 2, {255, 0, 0});
  EXPECT_EQ(image.rgb, before.rgb);
}

TEST(ScaledGap, TheMeanIsComputedInLinearLight) {
  Image image = plain(2, 1);
  image.rgb = {0, 0, 0, 255, 255, 255};
  const Image one = resizeImage(image, 1, 1);
  EXPECT_EQ(one.rgb, (std::vector<std::uint8_t>{188, 188, 188}));  // half the light, in sRGB
  EXPECT_EQ(resizeImage(plain(31, 17, 93), 7, 40).rgb, plain(7, 40, 93).rgb);
}

TEST(ContactSheet, ShowsEveryPictureOnceInAGrid) {
  std::vector<CaptionedImage> pictures;
  for (int i = 0; i < 5; ++i) {
    pictures.push_back({plain(100 + 20 * i, 80), "picture " + std::to_string(i)});
    for (std::size_t p = 0; p < pictures.back().image.rgb.size(); p += 3) {
      pictures.back().image.rgb[p] = static_cast<std::uint8_t>(200 + i);
    }
  }
  const Image sheet = makeContactSheet(pictures, "title", 2);
  std::array<int, 5> count{};
  for (std::size_t p = 0; p < sheet.rgb.size(); p += 3) {
    const int shade = sheet.rgb[p] - 200;
    if (shade >= 0 && shade < 5 && sheet.rgb[p + 1] == 0 && sheet.rgb[p + 2] == 0) {
      ++count[static_cast<std::size_t>(shade)];
    }
  }
  for (int i = 0; i < 5; ++i) EXPECT_EQ(count[static_cast<std::size_t>(i)], (100 + 20 * i) * 80);
  EXPECT_GT(makeContactSheet({}, "empty", 3).rgb.size(), 0u);
}

}  // namespace
}  // namespace enfilade::render
