#include "assets/feeder.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "assets/glb_writer.hpp"

namespace enfilade::assets {
namespace {

TEST(FeederAsset, HasATrayAStandAndTheParts) {
  const scene::Model model = makeFeeder({250, 1});
  std::size_t parts = 0, tray = 0;
  for (const scene::Object& object : model.objects) {
    parts += object.path.starts_with("feeder/part");
    tray += object.path.starts_with("feeder/tray/");
  }
  EXPECT_EQ(parts, 250u);
  EXPECT_EQ(tray, 5u);
  EXPECT_LT(model.meshes.size(), 15u) << "a mesh for each kind of part";
}

TEST(FeederAsset, IsTheSameFromRunToRunAndDiffersWithTheSeed) {
  EXPECT_EQ(encodeGlb(makeFeeder({50, 1})), encodeGlb(makeFeeder({50, 1})));
  EXPECT_NE(encodeGlb(makeFeeder({50, 1})), encodeGlb(makeFeeder({50, 2})));
}

TEST(FeederAsset, TheDriveIsAKeyASubstepEndsWhereItBeginsAndIsSlowEnough) {
  const auto sidecar = nlohmann::json::parse(makeFeederSidecar());
  const auto& keys = sidecar["bodies"][0]["keys"];
  ASSERT_GE(keys.size(), 9u) << "at most an eighth of the substeps' rate";
  EXPECT_EQ(keys.front()["offset"], keys.back()["offset"]);
  double highest = 0;
  for (std::size_t i = 0; i < keys.size(); ++i) {
    EXPECT_NEAR(keys[i]["time"].get<double>(), static_cast<double>(i) / 240, 1e-12);
    highest = std::max(highest, keys[i]["offset"][1].get<double>());
  }
  EXPECT_NEAR(highest, 2e-3, 1e-9);
}

TEST(FeederAsset, AbsurdNumbersOfPartsAreRefused) {
  EXPECT_THROW(makeFeeder({0, 1}), std::invalid_argument);
  EXPECT_THROW(makeFeeder({1000000, 1}), std::invalid_argument);
}

}  // namespace
}  // namespace enfilade::assets
