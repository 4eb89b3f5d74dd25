#include "server/floors/floor_plan_section.hpp"

#include <gtest/gtest.h>

#include <array>
#include <functional>
#include <random>
#include <utility>

#include "scene/model/box_mesh.hpp"

namespace enfilade::server {
namespace {

using collision::Vec3;

/// A column, 1 m square and 3 m high at (5, 0, 5). A wall of one face along x from 0 to 4 m, 2 m
/// high.
scene::Model makeColumnAndSheet() {
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
  const scene::Scene scene(makeColumnAndSheet());
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
  scene::Model model = makeColumnAndSheet();
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
  scene::Model model = makeColumnAndSheet();
  for (std::size_t i = 0; i < 8; ++i)
    model.meshes[0].positions.push_back(model.meshes[0].positions[i] + Eigen::Vector3f(3, 0, 0));
  for (std::size_t i = 0; i < 36; ++i)
    model.meshes[0].indices.push_back(model.meshes[0].indices[i] + 8);
  EXPECT_EQ(cutObject(model, 0, 1.2).loops.size(), 2u);
}

/// The sides of a box of 4 x 4 m in strips of 10 cm, of which every tenth is missing. `inwards`:
/// its triangles face the inside, as a room's.
scene::Model makeScannedBox(bool inwards, const std::function<bool(int strip)>& isMissing) {
  scene::Mesh mesh;
  const std::array<Vec3, 4> corners{Vec3(0, 0, 0), Vec3(0, 0, 4), Vec3(4, 0, 4),
                                    Vec3(4, 0, 0)};  // outward normals
  for (std::size_t side = 0; side < 4; ++side)
    for (int strip = 0; strip < 40; ++strip) {
      if (isMissing(strip)) continue;
      const Vec3 &a = corners[side], along = (corners[(side + 1) % 4] - a) / 40;
      const auto first = static_cast<std::uint32_t>(mesh.positions.size());
      for (const Vec3& at : {Vec3(a + strip * along), Vec3(a + (strip + 1) * along)}) {
        mesh.positions.push_back(at.cast<float>());
        mesh.positions.push_back((at + Vec3(0, 3, 0)).cast<float>());
      }
      for (const std::uint32_t i : {0u, 2u, 3u, 0u, 3u, 1u}) mesh.indices.push_back(first + i);
    }
  if (inwards)
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3)
      std::swap(mesh.indices[i], mesh.indices[i + 1]);
  scene::Model model;
  model.meshes = {mesh};
  model.objects.resize(1);
  model.objects[0].meshes = {0};
  return model;
}

TEST(FloorPlanSection, AnOutlineWithSmallHolesIsClosedAndARoomIsNot) {
  const auto isMissing = [](int strip) { return strip % 10 == 5; };
  const ObjectSection solid = cutObject(makeScannedBox(false, isMissing), 0, 1.2);
  EXPECT_EQ(solid.loops.size(), 1u);
  EXPECT_TRUE(solid.lines.empty());
  EXPECT_NEAR(computeLength(solid), 16, 1e-5);
  const ObjectSection room = cutObject(makeScannedBox(true, isMissing), 0, 1.2);
  EXPECT_TRUE(room.loops.empty());
  EXPECT_EQ(room.lines.size(), 16u);
  EXPECT_NEAR(computeLength(room), 16 - 1.6, 1e-5);
}

TEST(FloorPlanSection, NoStripIsLostWhicheverAreMissing) {
  std::mt19937 random(3);
  for (int scan = 0; scan < 200; ++scan) {
    std::bernoulli_distribution missing(0.01 * (scan % 60));
    int present = 0;
    const auto isMissing = [&](int) {
      const bool is = missing(random);
      present += is ? 0 : 1;
      return is;
    };
    const ObjectSection section = cutObject(makeScannedBox(false, isMissing), 0, 1.2);
    const double length = computeLength(section);  // with the holes of closed outlines
    EXPECT_GE(length, 0.1 * present - 1e-5);
    EXPECT_LE(length, section.loops.empty() ? 0.1 * present + 1e-5 : 16.5);
  }
}

}  // namespace
}  // namespace enfilade::server
