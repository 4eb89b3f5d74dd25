// Pages of plans: their headings are whole, however narrow they are, and they show all rooms.
#include <gtest/gtest.h>

#include <array>
#include <fstream>
#include <iterator>

#include "server/plans/floor_plans.hpp"
#include "server/plans/plan_drawing.hpp"
#include "tests/scene/box_scene.hpp"
#include "tests/scene/prism_space.hpp"
#include "tests/support/temporary_folder.hpp"

namespace enfilade::server {
namespace {

std::optional<PlanPicture> renderBlank(const render::Camera& camera) {
  const auto pixels = static_cast<std::size_t>(camera.width * camera.height);
  PlanPicture plan{{camera.width, camera.height, {}}, std::vector<std::uint32_t>(pixels, 1)};
  plan.colour.rgb.assign(3 * pixels, 200);
  return plan;
}

/// Width and height of an SVG page.
std::array<double, 2> readPageSize(const std::filesystem::path& file) {
  std::ifstream stream(file);
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  const auto read = [&](const std::string& name) {
    return std::stod(text.substr(text.find(name + "=\"") + name.size() + 2));
  };
  return {read("width"), read("height")};
}

TEST(PlanHeadings, ANarrowPageHasMoreLinesAboveThePlan) {
  const auto scene = scene::testing::makeBoxScene(
      {{"floor", {0, -0.2, 0}, {4, 0, 4}}, {"wall", {0, 0, 0}, {0.2, 3, 4}}});
  const tests::TemporaryFolder folder;
  const auto sizeAt = [&](const std::string& name) {
    const auto file = folder.getPath() / "page.svg";
    EXPECT_TRUE(writeStoreyPage(*scene, {0, name}, renderBlank, 100, file));
    return readPageSize(file);
  };
  const std::array<double, 2> shortName = sizeAt("EG"),
                              longName = sizeAt("Erdgeschoss mit Werkstatt, Lager und Anlieferung");
  EXPECT_EQ(shortName[0], longName[0]);
  EXPECT_GT(longName[1], shortName[1] + 10);
}

TEST(PlanPages, RoomsFarFromWallsAreOnThePage) {
  scene::Model model = scene::testing::makeBoxModel(
      {{"floor", {0, -0.2, 0}, {40, 0, 40}}, {"wall", {0, 0, 0}, {0.2, 3, 20}}});
  model.storeys = {{"EG", "", 0}};
  const tests::TemporaryFolder folder;
  const auto file = folder.getPath() / "page.svg";
  const auto writePage = [&] {
    EXPECT_TRUE(writeStoreyPage(scene::Scene(model), {0, "EG", 0}, renderBlank, 100, file));
    return readPageSize(file);
  };
  const std::array<double, 2> wallAlone = writePage();
  // A terrace, 10 m east of the wall and 10 m wide.
  model.spaces = {tests::makePrism({{10, 0}, {20, 0}, {20, 20}, {10, 20}}, 3)};
  model.spaces[0].storey = 0, model.spaces[0].longName = "Terrasse";
  const std::array<double, 2> withTerrace = writePage();
  constexpr double kPointsPerMetre = 72 / 0.0254 / 100;
  EXPECT_GT(withTerrace[0], 24 * kPointsPerMetre);
  EXPECT_LT(wallAlone[0], 24 * kPointsPerMetre);
}

TEST(PlanHeadings, NoLineIsCut) {
  for (const double width : {200.0, 400.0, 1200.0}) {
    const PlanHeading heading = makePlanHeading(
        "House.ifc: Erdgeschoss mit Werkstatt und Lager",
        formatFloorAndCut(0) + ", scale 1:100; facing 0 looks right (+x), 90 up (-z)", width, 0.7);
    std::string all;
    for (const auto* lines : {&heading.title, &heading.note})
      for (const std::string& line : *lines) all += line + " ";
    EXPECT_EQ(all.find("…"), std::string::npos) << all;
    EXPECT_NE(all.find("Lager"), std::string::npos) << all;
    EXPECT_NE(all.find("90 up (-z)"), std::string::npos) << all;
    const render::Canvas measuring(1, 1, kPlanPaper);
    for (const std::string& line : heading.note)
      EXPECT_LE(measuring.measure(line, heading.noteStyle).width, width) << line;
  }
}

}  // namespace
}  // namespace enfilade::server
