#include "server/plans/floor_plan_section.hpp"

#include <gtest/gtest.h>

namespace enfilade::server {
namespace {

using collision::Vec3;

/// A column, 1 m square and 3 m high at (5, 0, 5), and a wall of one face along x from 0 to 4 m, 2
/// m high.
scene::Model columnAndSheet() {
  scene::Mesh column, sheet;
  for (int i = 0; i < 8; ++i)
    column.positions.emplace_back((i & 1) != 0 ? 5.5f : 4.5f, (i & 2) != 0 ? 3.0f : 0.0f,
                                  (i & 4) != 0 ? 5.5f : 4.5f);
  column.indices = {0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4,
                    2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5};
  sheet.positions = {{0, 0, 0}, {4, 0, 0}, {4, 2, 0}, {0, 2, 0}};
  sheet.indices = {0, 1, 2, 0, 2, 3};
  scene::Model model;
  model.meshes = {column, sheet};
  model.objects.resize(2);
  for (std::uint32_t i = 0; i < 2; ++i) {
    model.objects[i].path = i == 0 ? "column" : "sheet";
    model.objects[i].meshes = {i};
  }
  return model;
}

double lengthOf(const std::vector<SectionLine>& lines) {
  double length = 0;
  for (const SectionLine& line : lines) length += (line.to - line.from).norm();
  return length;
}

TEST(PlanCut, ClosedSolidsGiveTheirOutlineAndSingleFacesTheirLine) {
  const scene::Scene scene(columnAndSheet());
  const auto both = cutScene(scene, 1.2);
  EXPECT_NEAR(lengthOf(both), 4 + 4, 1e-6);
  for (const SectionLine& line : both) {
    EXPECT_EQ(line.from.y(), 1.2);
    EXPECT_EQ(line.to.y(), 1.2);
  }
  EXPECT_NEAR(lengthOf(cutScene(scene, 2.5)), 4, 1e-6);  // the column alone
  EXPECT_TRUE(cutScene(scene, 3.5).empty());
  EXPECT_TRUE(cutScene(scene, -0.5).empty());
}

TEST(PlanCut, BodiesAreCutWhereTheModelHasThemAndTriggersAreNot) {
  scene::Model model = columnAndSheet();
  scene::BodySpec door;
  door.name = "door";
  door.kind = scene::BodyKind::sliding;
  door.objects = {1};
  door.axis = Vec3::UnitX();
  door.high = 1;
  model.bodies = {door};
  EXPECT_NEAR(lengthOf(cutScene(scene::Scene(model), 1.2)), 8, 1e-6);
  model.bodies[0].kind = scene::BodyKind::trigger;
  EXPECT_NEAR(lengthOf(cutScene(scene::Scene(model), 1.2)), 4, 1e-6);
}

}  // namespace
}  // namespace enfilade::server
