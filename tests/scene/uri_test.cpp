#include "scene/import/worker/uri.hpp"

#include <gtest/gtest.h>

namespace enfilade::scene {
namespace {

TEST(Uri, BytesOfTwoDigitsAreDecodedAndOtherPercentSignsStay) {
  EXPECT_EQ(percentDecoded("a%20b%C3%a4.png"), "a b\xC3\xA4.png");
  EXPECT_EQ(percentDecoded("%41%"), "A%");
  EXPECT_EQ(percentDecoded("100%4"), "100%4");
  EXPECT_EQ(percentDecoded("%2g%-1%+1% 1"), "%2g%-1%+1% 1");
  EXPECT_EQ(percentDecoded("%2541"), "%41");
  EXPECT_EQ(percentDecoded(""), "");
}

}  // namespace
}  // namespace enfilade::scene
