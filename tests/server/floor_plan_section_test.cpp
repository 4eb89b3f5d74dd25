#include "server/plans/floor_plan_section.hpp"

#include <gtest/gtest.h>

#include "scene/model/box_mesh.hpp"

namespace enfilade::server {
namespace {

using collision::Vec3;

/// A column, 1 m square and 3 m high at (5, 0, 5), and a wall of one face along x from 0 to 4 m, 2
/// m high.
scene::Model columnAndSheet() {
  const scene::Mesh column = scene::makeBoxMesh({{4.5, 0, 4.5}, {5.5, 3, 5.5}});
  scene::Mesh sheet;
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

double computeLength(const ObjectSection& section) {
  double length = 0;
  for (const auto& loop : section.loops)
    for (std::size_t i = 0; i < loop.size(); ++i)
      length += (loop[(i + 1) % loop.size()] - loop[i]).norm();
  for (const auto& line : section.lines)
    for (std::size_t i = 1; i < line.size(); ++i) length += (line[i] - line[i - 1]).norm();
  return length;
}

TEST(FloorPlanSection, ClosedSolidsGiveOneLoopAndSingleFacesOneLine) {
  const scene::Scene scene(columnAndSheet());
  const auto both = cutStatic(scene, 1.2);
  ASSERT_EQ(both.size(), 2u);
  EXPECT_EQ(both[0].loops.size(), 1u);
  EXPECT_TRUE(both[0].lines.empty());
  EXPECT_NEAR(computeLength(both[0]), 4, 1e-6);
  EXPECT_EQ(both[0].box.max.y(), 3);
  EXPECT_TRUE(both[1].loops.empty());
  EXPECT_EQ(both[1].lines.size(), 1u);
  EXPECT_NEAR(computeLength(both[1]), 4, 1e-6);
  for (const Vec3& point : both[0].loops[0]) EXPECT_EQ(point.y(), 1.2);
  EXPECT_EQ(cutStatic(scene, 2.5).size(), 1u);  // the column alone
  EXPECT_TRUE(cutStatic(scene, 3.5).empty());
  EXPECT_TRUE(cutStatic(scene, -0.5).empty());
}

TEST(FloorPlanSection, BodiesAreNotStaticAndAreCutAlone) {
  scene::Model model = columnAndSheet();
  scene::BodySpec door;
  door.name = "door";
  door.kind = scene::BodyKind::sliding;
  door.objects = {1};
  door.axis = Vec3::UnitX();
  door.high = 1;
  model.bodies = {door};
  EXPECT_EQ(cutStatic(scene::Scene(model), 1.2).size(), 1u);
  EXPECT_NEAR(computeLength(cutObject(model, 1, 1.2)), 4, 1e-6);
}

TEST(FloorPlanSection, TwoOutlinesOfOneObjectAreTwoLoops) {
  scene::Model model = columnAndSheet();
  for (std::size_t i = 0; i < 8; ++i)
    model.meshes[0].positions.push_back(model.meshes[0].positions[i] + Eigen::Vector3f(3, 0, 0));
  for (std::size_t i = 0; i < 36; ++i)
    model.meshes[0].indices.push_back(model.meshes[0].indices[i] + 8);
  EXPECT_EQ(cutObject(model, 0, 1.2).loops.size(), 2u);
}

}  // namespace
}  // namespace enfilade::server
