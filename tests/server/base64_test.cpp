// Tests of base64 against the examples of RFC 4648, section 10.
#include "server/export/base64.hpp"

#include <gtest/gtest.h>

#include <string>

namespace enfilade::server::testing {
namespace {

std::string encodeText(const std::string& text) {
  return encodeBase64({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

TEST(Base64, EqualsTheExamplesOfTheStandard) {
  EXPECT_EQ(encodeText(""), "");
  EXPECT_EQ(encodeText("f"), "Zg==");
  EXPECT_EQ(encodeText("fo"), "Zm8=");
  EXPECT_EQ(encodeText("foo"), "Zm9v");
  EXPECT_EQ(encodeText("foobar"), "Zm9vYmFy");
  EXPECT_EQ(encodeText(std::string("\xff\xfe\0\x80", 4)), "//4AgA==");
}

}  // namespace
}  // namespace enfilade::server::testing
