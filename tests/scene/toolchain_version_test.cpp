#include "scene/import/toolchain_version.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

#include "scene/import/assimp/assimp_reader.hpp"
#include "scene/import/ifc/ifc_plus_plus.hpp"
#include "tests/support/temporary_folder.hpp"

namespace enfilade::scene {
namespace {

using tests::readContent;
using tests::TemporaryFolder;

TEST(ToolchainVersion, ALibraryIsIdentifiedByItsBuildIdAlone) {
  const TemporaryFolder folder;
  const std::string bytes = readContent(findAssimpModule());
  const auto copy = folder.write("copy.so", bytes + "and more behind it");
  ASSERT_TRUE(computeFileVersion(copy));
  EXPECT_EQ(computeFileVersion(copy), computeFileVersion(findAssimpModule()));
  EXPECT_NE(computeFileVersion(copy), computeFileHash(copy));
  EXPECT_NE(computeFileVersion(copy), computeFileVersion(findIfcPlusPlusModule()));
  EXPECT_NE(computeFileVersion(copy), computeFileVersion("/proc/self/exe"));
}

TEST(ToolchainVersion, OtherFilesAreIdentifiedByTheirContent) {
  const TemporaryFolder folder;
  const std::string library = readContent(findAssimpModule());
  // Truncated in the header, in the program header table, before the notes; and a header followed
  // by noise.
  for (const std::string& bytes :
       {std::string("text"), library.substr(0, 20), library.substr(0, 100), library.substr(0, 560),
        library.substr(0, 64) + std::string(2000, '\xff'), std::string()}) {
    const auto file = folder.write("file", bytes);
    ASSERT_TRUE(computeFileVersion(file)) << bytes.size();
    EXPECT_EQ(computeFileVersion(file), computeFileHash(file)) << bytes.size();
  }
  EXPECT_FALSE(computeFileVersion(folder.getPath() / "missing"));
  EXPECT_FALSE(computeFileVersion(folder.getPath()));
}

}  // namespace
}  // namespace enfilade::scene
