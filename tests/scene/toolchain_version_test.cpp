#include "scene/import/toolchain_version.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

#include "scene/import/assimp/assimp_reader.hpp"
#include "scene/import/ifc/ifc_plus_plus.hpp"
#include "tests/support/temporary_folder.hpp"

namespace enfilade::scene {
namespace {

using tests::TemporaryFolder;

std::string contentOf(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST(ReaderVersion, ALibraryIsKnownByItsBuildIdAlone) {
  const TemporaryFolder folder;
  const std::string bytes = contentOf(assimpModule());
  const auto copy = folder.write("copy.so", bytes + "and more behind it");
  ASSERT_TRUE(versionOf(copy));
  EXPECT_EQ(versionOf(copy), versionOf(assimpModule()));
  EXPECT_NE(versionOf(copy), contentHashOfFile(copy));
  EXPECT_NE(versionOf(copy), versionOf(ifcPlusPlusModule()));
  EXPECT_NE(versionOf(copy), versionOf("/proc/self/exe"));
}

TEST(ReaderVersion, WhatIsNoLibraryIsKnownByItsContent) {
  const TemporaryFolder folder;
  const std::string library = contentOf(assimpModule());
  // Cut in its header, in the table of its parts, before its notes; a header and then noise.
  for (const std::string& bytes :
       {std::string("text"), library.substr(0, 20), library.substr(0, 100), library.substr(0, 560),
        library.substr(0, 64) + std::string(2000, '\xff'), std::string()}) {
    const auto file = folder.write("file", bytes);
    ASSERT_TRUE(versionOf(file)) << bytes.size();
    EXPECT_EQ(versionOf(file), contentHashOfFile(file)) << bytes.size();
  }
  EXPECT_FALSE(versionOf(folder.path() / "missing"));
  EXPECT_FALSE(versionOf(folder.path()));
}

}  // namespace
}  // namespace enfilade::scene
