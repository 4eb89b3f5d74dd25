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

}  // namespace
}  // namespace enfilade::scene
