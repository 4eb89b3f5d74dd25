// Tests of caching a scene's report.
#include "server/inspection/report_cache.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "tests/scene/hand_made_files.hpp"
#include "tests/server/small_room.hpp"

namespace enfilade::server::testing {
namespace {

namespace fs = std::filesystem;

class ReportCache : public ::testing::Test {
 protected:
  std::vector<fs::path> listKept() const {
    std::vector<fs::path> files;
    if (!fs::exists(cache_->folder)) return files;
    for (const auto& entry : fs::directory_iterator(cache_->folder)) files.push_back(entry);
    return files;
  }
  static scene::Model makeModelWithProblem() {
    scene::Model model = makeSmallRoom()->model();
    model.diagnostics.push_back({"missing_texture", 3, "a \"quoted\" name, with a line\nbreak"});
    return model;
  }

  tests::TemporaryFolder folder_;
  std::optional<scene::ModelCache> cache_{{folder_.getPath() / "cache"}};
};

TEST_F(ReportCache, EqualsTheComputedReport) {
  const scene::Scene scene(makeModelWithProblem());
  const std::string worked = serializeReport(scene::makeSceneReport(scene));
  EXPECT_EQ(serializeReport(loadOrMakeReport(scene, std::nullopt)), worked);
  EXPECT_TRUE(listKept().empty());
  EXPECT_EQ(serializeReport(loadOrMakeReport(scene, cache_)), worked);
  ASSERT_EQ(listKept().size(), 1u);
  const scene::SceneReport again = loadOrMakeReport(scene, cache_);
  EXPECT_EQ(serializeReport(again), worked);
  EXPECT_EQ(again.shells.exact, 3u);
  EXPECT_EQ(again.diagnostics.at(0).example, makeModelWithProblem().diagnostics[0].example);
}

TEST_F(ReportCache, IsNotUsedForAnotherSceneOrOtherDiagnostics) {
  loadOrMakeReport(scene::Scene(makeModelWithProblem()), cache_);
  scene::Model other = makeModelWithProblem();
  other.diagnostics[0].count = 4;
  EXPECT_EQ(loadOrMakeReport(scene::Scene(other), cache_).diagnostics.at(0).count, 4u);
  other.meshes[0].positions[0].x() += 1;
  EXPECT_EQ(loadOrMakeReport(scene::Scene(other), cache_).shells.exact, 2u);
  EXPECT_EQ(listKept().size(), 3u);
}

TEST_F(ReportCache, ADamagedTextIsRecomputed) {
  const scene::Scene scene(makeModelWithProblem());
  const std::string worked = serializeReport(loadOrMakeReport(scene, cache_));
  const fs::path file = listKept().at(0);
  std::ifstream in(file, std::ios::binary);
  const std::string whole((std::istreambuf_iterator<char>(in)), {});
  for (std::size_t at = 0; at < whole.size(); at += 7) {
    std::string damaged = whole;
    damaged[at] ^= 1;
    if (at % 2) damaged.resize(at);
    std::ofstream(file, std::ios::binary) << damaged;
    EXPECT_EQ(serializeReport(loadOrMakeReport(scene, cache_)), worked) << at;
    EXPECT_EQ(fs::file_size(file), whole.size()) << "the entry was not rewritten";
  }
}

TEST_F(ReportCache, AnInvalidTextIsNoReport) {
  for (const char* text : {"", "{}", "[1]", "{\"objects\":-1}", "null"})
    EXPECT_FALSE(parseReport(text)) << text;
  EXPECT_TRUE(parseReport(serializeReport({})));
}

}  // namespace
}  // namespace enfilade::server::testing
