#include "render/image/image.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <random>
#include <set>
#include <vector>

#include "render/image/atomic_file.hpp"
#include "render/image/canvas.hpp"
#include "render/image/contact_sheet.hpp"
#include "tests/support/temporary_folder.hpp"

namespace enfilade::render {
namespace {

namespace fs = std::filesystem;

Image makePlainImage(int width, int height, std::uint8_t value = 0) {
  Image image{width, height, {}};
  image.rgb.assign(3 * static_cast<std::size_t>(width * height), value);
  return image;
}

int getRed(const Image& image, int x, int y) {
  return image.rgb[3 * static_cast<std::size_t>(y * image.width + x)];
}

long countEntriesIn(const tests::TemporaryFolder& folder) {
  return std::distance(fs::directory_iterator(folder.getPath()), {});
}

TEST(Png, RoundTripKeepsEveryByte) {
  std::mt19937 random(3);
  for (const auto& [width, height] : {std::pair(1, 1), std::pair(37, 5), std::pair(64, 64)}) {
    Image image = makePlainImage(width, height);
    for (auto& byte : image.rgb) byte = static_cast<std::uint8_t>(random() & 255u);
    const Image back = decodePng(encodePng(image));
    EXPECT_EQ(back.width, width);
    EXPECT_EQ(back.height, height);
    EXPECT_EQ(back.rgb, image.rgb);
  }
}

TEST(Png, BrokenBytesAndWrongSizesAreErrors) {
  std::vector<std::uint8_t> png = encodePng(makePlainImage(20, 20, 90));
  png.resize(png.size() / 2);
  EXPECT_THROW(decodePng(png), std::runtime_error);
  EXPECT_THROW(decodePng({}), std::runtime_error);
  Image wrong = makePlainImage(4, 4);
  wrong.width = 5;
  EXPECT_THROW(encodePng(wrong), std::runtime_error);
}

TEST(AtomicFile, ReplacesAFileAndLeavesNothingElse) {
  const tests::TemporaryFolder folder;
  const fs::path file = folder.getPath() / "a.bin";
  writeFileAtomically(file, "first", 5);
  writeFileAtomically(file, "second!", 7);
  std::ifstream in(file);
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(in), {}), "second!");
  EXPECT_EQ(countEntriesIn(folder), 1);
}

TEST(AtomicFile, APipeIsWrittenAndALinkFollowed) {
  const tests::TemporaryFolder folder;
  const fs::path pipe = folder.getPath() / "pipe", link = folder.getPath() / "link";
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
  EXPECT_EQ(fs::file_size(folder.getPath() / "file"), 6U);
  EXPECT_EQ(countEntriesIn(folder), 3);

  fs::create_symlink("circle", folder.getPath() / "circle");
  EXPECT_THROW(writeFileAtomically(folder.getPath() / "circle", "x", 1), std::runtime_error);
}

TEST(AtomicFile, AFailureNamesTheFileAndLeavesNoPart) {
  const tests::TemporaryFolder folder;
  const fs::path taken = folder.getPath() / "taken";
  fs::create_directories(taken / "inside");
  for (const fs::path& file : {taken, folder.getPath() / "missing" / "a.png"}) {
    try {
      writePng(file, makePlainImage(2, 2));
      ADD_FAILURE() << "written to " << file;
    } catch (const std::runtime_error& error) {
      EXPECT_NE(std::string(error.what()).find(file.string()), std::string::npos);
    }
  }
  EXPECT_EQ(countEntriesIn(folder), 1);
}

constexpr Colour kBlack{0, 0, 0}, kWhite{255, 255, 255};

/// Covered pixels of a canvas that is black where nothing is drawn.
double computeArea(const Canvas& canvas) {
  const Image image = canvas.toImage();
  double area = 0;
  for (std::size_t i = 0; i < image.rgb.size(); i += 3) area += image.rgb[i] / 255.0;
  return area;
}

TEST(Canvas, ImagesComeBackAsTheyWere) {
  Image image = makePlainImage(7, 5);
  for (std::size_t i = 0; i < image.rgb.size(); ++i)
    image.rgb[i] = static_cast<std::uint8_t>(2 * i + 1);
  EXPECT_EQ(Canvas(image).toImage().rgb, image.rgb);
  Canvas onto(7, 5, kBlack);
  onto.image(image, {0, 0}, 7, 5);
  EXPECT_EQ(onto.toImage().rgb, image.rgb);
}

TEST(Canvas, ShapesHaveTheirArea) {
  Canvas disc(60, 60, kBlack), loop(60, 60, kBlack), arc(60, 60, kBlack);
  disc.disc({30.3, 29.6}, 12, kWhite);
  EXPECT_NEAR(computeArea(disc), 3.14159265 * 144, 5);
  // A square with a hole.
  loop.fill(std::vector<std::vector<Point>>{{{10, 10}, {50, 10}, {50, 50}, {10, 50}},
                                            {{20, 20}, {40, 20}, {40, 40}, {20, 40}}},
            kWhite);
  EXPECT_NEAR(computeArea(loop), 1600 - 400, 5);
  arc.arc({30, 30}, 20, 0, 1.5, 2, kWhite);
  EXPECT_NEAR(computeArea(arc), 1.5 * 20 * 2 + 3.14, 5);  // with its round caps
}

TEST(Canvas, ALineHasItsLengthTimesItsThicknessInEveryDirection) {
  for (int degrees = 0; degrees < 360; degrees += 15) {
    const double angle = degrees * 3.14159265358979 / 180;
    Canvas canvas(120, 120, kBlack);
    canvas.line({60, 60}, {60 + 40 * std::cos(angle), 60 + 40 * std::sin(angle)}, 3, kWhite);
    EXPECT_NEAR(computeArea(canvas), 40 * 3 + 3.14159265 * 2.25, 6)
        << degrees;  // with its round caps
  }
}

TEST(Canvas, PointsOutsideAndNonFiniteOnesDrawNothing) {
  Canvas canvas(10, 10, kBlack);
  canvas.line({-50, -50}, {-1e6, -20}, 3, kWhite);
  canvas.line({std::nan(""), 0}, {5, 5}, 3, kWhite);
  canvas.disc({100, 100}, 3, kWhite);
  canvas.disc({std::nan(""), 1}, 3, kWhite);
  canvas.text({-100, -100}, "text", {});
  canvas.text({std::nan(""), 1}, "text", {});
  EXPECT_EQ(computeArea(canvas), 0);
}

TEST(Canvas, LettersOfAllScriptsDiffer) {
  TextStyle style;
  style.size = 20, style.colour = kWhite;
  std::vector<std::vector<std::uint8_t>> pictures;
  for (const char* text : {"A", "Ä", "ß", "é", "Ж", "Ω", "A\xff"}) {
    Canvas canvas(60, 30, kBlack);
    canvas.text({4, 2}, text, style);
    EXPECT_GT(computeArea(canvas), 10) << text;
    pictures.push_back(canvas.toImage().rgb);
    EXPECT_EQ(std::count(pictures.begin(), pictures.end(), pictures.back()), 1) << text;
  }
}

TEST(Canvas, TextIsAlignedMeasuredAndShortened) {
  TextStyle style;
  style.size = 16, style.colour = kWhite;
  Canvas canvas(400, 30, kBlack);
  const double width = canvas.measure("Küche", style).width;
  EXPECT_GT(canvas.measure("Küche und Flur", style).width, 2 * width);
  EXPECT_EQ(canvas.shorten("Küche", style, width + 1), "Küche");
  const std::string cut = canvas.shorten("Küche und Flur", style, 2 * width);
  EXPECT_LE(canvas.measure(cut, style).width, 2 * width);
  EXPECT_TRUE(cut.starts_with("Küche") && cut.ends_with("…")) << cut;
  canvas.text({300, 4}, "Küche", style, Align::right);
  const Image image = canvas.toImage();
  int left = 400, right = 0;
  for (int x = 0; x < 400; ++x)
    for (int y = 0; y < 30; ++y)
      if (getRed(image, x, y) > 128) left = std::min(left, x), right = std::max(right, x);
  EXPECT_NEAR(left, 300 - width, 3);
  EXPECT_NEAR(right, 300, 3);
}

TEST(Canvas, WrapsBetweenWordsAndKeepsEveryLetter) {
  const Canvas canvas(1, 1, kBlack);
  TextStyle style;
  style.size = 16;
  const auto join = [](const std::vector<std::string>& lines) {
    std::string all;
    for (const std::string& line : lines) all += (all.empty() ? "" : " ") + line;
    return all;
  };
  const std::string text = "Grundriß der Küche und des Flurs";
  const double width = canvas.measure("Grundriß der", style).width + 1;
  const std::vector<std::string> lines = canvas.wrap(text, style, width, 9);
  EXPECT_GT(lines.size(), 2u);
  EXPECT_EQ(lines[0], "Grundriß der");
  EXPECT_EQ(join(lines), text);
  for (const std::string& line : lines) EXPECT_LE(canvas.measure(line, style).width, width) << line;
  // A word without spaces is broken; of too many lines the last is cut.
  EXPECT_GT(canvas.wrap(std::string(80, 'm'), style, width, 40).size(), 3u);
  const std::vector<std::string> two = canvas.wrap(text, style, width, 2);
  ASSERT_EQ(two.size(), 2u);
  EXPECT_TRUE(two[1].ends_with("…")) << two[1];
  EXPECT_EQ(canvas.wrap("Flur", style, width, 1), std::vector<std::string>{"Flur"});
}

TEST(Canvas, KindsOfLinesDifferInTheirInk) {
  std::vector<double> areas;
  for (const LineKind kind : {LineKind::dotted, LineKind::dashed, LineKind::dashDot,
                              LineKind::longDashes, LineKind::solid}) {
    Canvas canvas(320, 20, kBlack);
    canvas.polyline(std::array{Point{10, 10}, Point{310, 10}}, 3, kWhite, kind);
    areas.push_back(computeArea(canvas));
  }
  EXPECT_TRUE(std::ranges::is_sorted(areas));
  EXPECT_LT(areas[0], 0.7 * areas.back());
  EXPECT_LT(areas[3], 0.95 * areas.back());
}

TEST(Canvas, NamesTheFirstTextWithoutAFont) {
  Canvas canvas(200, 100, {255, 255, 255});
  canvas.text({10, 10}, "Grüße, Ωμέγα", {});
  EXPECT_EQ(canvas.textWithoutFont(), "");
  const std::string privateUse = "\xf4\x8f\xbf\xbd";  // U+10FFFD: no font has it
  canvas.text({10, 30}, "a" + privateUse, {});
  canvas.text({10, 50}, privateUse, {});
  EXPECT_EQ(canvas.textWithoutFont(), "a" + privateUse);
}

TEST(Canvas, DrawsLettersOfChineseJapaneseAndKorean) {
  std::set<std::vector<std::uint8_t>> pictures;
  for (const char* letter : {"客", "厅", "リ", "ビ", "ん", "거", "실"}) {
    Canvas canvas(60, 60, kBlack);
    canvas.text({10, 10}, letter, {.size = 30, .colour = kWhite});
    EXPECT_EQ(canvas.textWithoutFont(), "") << letter;
    EXPECT_TRUE(pictures.insert(canvas.toImage().rgb).second) << letter << " looks like another";
  }
}

TEST(Canvas, PagesAreWrittenWhole) {
  const tests::TemporaryFolder folder;
  for (const auto& [name, start] :
       {std::pair("page.svg", std::string("<?xml")), {"page.pdf", std::string("%PDF")}}) {
    Canvas page(folder.getPath() / name, 200, 100, kWhite);
    page.line({0, 0}, {200, 100}, 1, kBlack);
    page.text({10, 10}, "Grundriß", {});
    page.finish();
    std::ifstream file(folder.getPath() / name);
    const std::string bytes{std::istreambuf_iterator<char>(file), {}};
    EXPECT_TRUE(bytes.starts_with(start)) << name;
    EXPECT_GT(bytes.size(), 500u) << name;
  }
  EXPECT_THROW(Canvas(folder.getPath() / "page.png", 10, 10, kWhite), std::invalid_argument);
  Canvas nowhere(folder.getPath() / "missing" / "page.svg", 10, 10, kWhite);
  EXPECT_THROW(nowhere.finish(), std::runtime_error);
}

TEST(ResizeImage, TheMeanIsComputedInLinearLight) {
  Image image = makePlainImage(2, 1);
  image.rgb = {0, 0, 0, 255, 255, 255};
  const Image one = resizeImage(image, 1, 1);
  EXPECT_EQ(one.rgb, (std::vector<std::uint8_t>{188, 188, 188}));  // half the light, in sRGB
  EXPECT_EQ(resizeImage(makePlainImage(31, 17, 93), 7, 40).rgb, makePlainImage(7, 40, 93).rgb);
}

TEST(ContactSheet, ShowsEveryPictureOnceInAGrid) {
  std::vector<CaptionedImage> pictures;
  for (int i = 0; i < 5; ++i) {
    pictures.push_back({makePlainImage(100 + 20 * i, 80), "picture " + std::to_string(i)});
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

TEST(ContactSheet, LongTextsHaveMoreLines) {
  const auto computeHeight = [](const std::string& title, const std::string& caption) {
    return makeContactSheet({{makePlainImage(320, 240), caption}}, title, 4).height;
  };
  const int small = computeHeight("es.jsonl", "lamp");
  EXPECT_GT(computeHeight("es.jsonl in schependomlaan_establishment.ifc", "lamp"), small);
  EXPECT_GT(
      computeHeight("es.jsonl", "lamp  ann  tick 123456  (-1234.5, 12.3, -2345.6), from the door"),
      small);
}

}  // namespace
}  // namespace enfilade::render
