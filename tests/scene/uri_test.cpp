#include "scene/import/file/uri.hpp"

#include <gtest/gtest.h>

namespace enfilade::scene {
namespace {

TEST(Uri, BytesOfTwoDigitsAreDecodedAndOtherPercentSignsStay) {
  EXPECT_EQ(decodePercent("a%20b%C3%a4.png"), "a b\xC3\xA4.png");
  EXPECT_EQ(decodePercent("%41%"), "A%");
  EXPECT_EQ(decodePercent("100%4"), "100%4");
  EXPECT_EQ(decodePercent("%2g%-1%+1% 1"), "%2g%-1%+1% 1");
  EXPECT_EQ(decodePercent("%2541"), "%41");
  EXPECT_EQ(decodePercent(""), "");
}

TEST(Uri, TheMiddleOfALongOneIsLeftOutOfMessages) {
  EXPECT_EQ(shortenUri("a.bin"), "a.bin");
  std::string text = "data:;base64,";
  for (int i = 0; i < 50'000; ++i) text += "\xC3\xA4";
  const std::string cut = shortenUri(text);
  EXPECT_LT(cut.size(), 120u);
  // Characters of two bytes stay whole: bytes 59 and 60 are one, the last 20 are ten.
  EXPECT_EQ(cut.find(".."), 59u);
  EXPECT_EQ(cut.substr(cut.size() - 20), text.substr(text.size() - 20));
}

}  // namespace
}  // namespace enfilade::scene
