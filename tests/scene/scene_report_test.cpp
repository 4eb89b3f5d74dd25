#include "scene/world/queries/scene_report.hpp"

#include <gtest/gtest.h>

#include <map>
#include <random>
#include <utility>

#include "scene/model/coplanar_surfaces.hpp"
#include "scene/model/diagnostic_catalog.hpp"
#include "tests/scene/box_scene.hpp"

namespace enfilade::scene {
namespace {

std::size_t countDiagnostics(const SceneReport& report, const std::string& kind) {
  for (const Diagnostic& problem : report.diagnostics) {
    if (problem.kind == kind) return problem.count;
  }
  return 0;
}

std::string findExample(const SceneReport& report, const std::string& kind) {
  for (const Diagnostic& problem : report.diagnostics) {
    if (problem.kind == kind) return problem.example;
  }
  return "";
}

TEST(SceneReport, CountsObjectsTrianglesAndConvexParts) {
  Model model = testing::makeBoxModel({{"a", {0, 0, 0}, {1, 1, 1}}, {"b", {2, 0, 0}, {3, 1, 1}}});
  model.objects.push_back({"copy", "", {0}, Eigen::Affine3d(Eigen::Translation3d(5, 0, 0))});
  Mesh open = model.meshes[0];
  open.indices.resize(30);
  model.meshes.push_back(open);
  model.objects.push_back({"open", "", {2}, Eigen::Affine3d(Eigen::Translation3d(7, 0, 0))});
  const SceneReport report = makeSceneReport(Scene(std::move(model)));
  EXPECT_EQ(report.objects, 4u);
  EXPECT_EQ(report.meshes, 3u);
  EXPECT_EQ(report.triangles, 46u);
  EXPECT_EQ(report.uniqueTriangles, 34u);
  EXPECT_EQ(report.shells.exact, 3u);
  EXPECT_EQ(report.shells.open, 1u);
  EXPECT_EQ(report.hullTriangles, 36u);
  EXPECT_EQ(report.partTriangles, 10u);
  EXPECT_TRUE(report.diagnostics.empty());
}

TEST(SceneReport, ReportsDiagnosticsWithTheirFirstExample) {
  Model model = testing::makeBoxModel({{"right", {0, 0, 0}, {1, 1, 1}},
                                       {"repeats", {0, 0, 0}, {1, 2, 1}},
                                       {"turned", {4, 0, 0}, {5, 1, 0.2}},
                                       {"flat", {6, 0, 0}, {7, 1, 1}},
                                       {"twisted", {8, 0, 0}, {9, 1, 1}}});
  auto& repeats = model.meshes[1].indices;
  repeats.insert(repeats.end(), {0, 2, 3, 0, 3, 1, 1, 1, 1});
  auto& turned = model.meshes[2].indices;
  for (std::size_t i = 0; i < turned.size(); i += 3) std::swap(turned[i], turned[i + 1]);
  model.meshes[3].indices = {0, 0, 1};
  std::swap(model.meshes[4].indices[0], model.meshes[4].indices[1]);
  Object again = model.objects[0];
  again.path = "again";
  model.objects.push_back(again);
  model.diagnostics.push_back({"missing_texture", 2, "wall.png"});
  const SceneReport report = makeSceneReport(Scene(std::move(model)));
  EXPECT_EQ(report.diagnostics.at(0).kind, "missing_texture");
  EXPECT_EQ(countDiagnostics(report, "duplicate_triangle"), 2u);
  EXPECT_EQ(countDiagnostics(report, "degenerate_triangle"), 2u);
  EXPECT_EQ(countDiagnostics(report, "inside_out_solid"), 1u);
  EXPECT_EQ(countDiagnostics(report, "inconsistent_winding"), 1u);
  EXPECT_EQ(countDiagnostics(report, "object_without_area"), 1u);
  EXPECT_EQ(countDiagnostics(report, "repeated_object"), 1u);
  EXPECT_EQ(findExample(report, "repeated_object"), "again");
  EXPECT_EQ(findExample(report, "inside_out_solid"), "turned");
}

TEST(SceneReport, RepeatedObjectsHaveTheShapeAndTheTransformOfAnother) {
  Model model =
      testing::makeBoxModel({{"box", {1, 0, 0}, {2, 1, 1}}, {"tall", {1, 0, 0}, {2, 2, 1}}});
  for (const double zero : {0.0, -0.0}) {
    Object again = model.objects[0];
    again.path = "again" + std::to_string(zero);
    again.worldFromMesh.translation().z() = zero;
    model.objects.push_back(again);
  }
  Object moved = model.objects[0];
  moved.worldFromMesh.translation().x() += 5;
  model.objects.push_back(moved);
  model.objects[0].worldFromMesh.translation().z() = 0;
  const SceneReport report = makeSceneReport(Scene(std::move(model)));
  EXPECT_EQ(countDiagnostics(report, "repeated_object"), 2u);
}

/// The coplanar pairs of two boxes, the second of another colour if `coloured`.
std::size_t countCoplanar(const testing::NamedBox& a, const testing::NamedBox& b, bool coloured) {
  Model model = testing::makeBoxModel({a, b});
  model.materials.emplace_back();
  model.materials[1].baseColour = {1, 0, 0, 1};
  if (coloured) model.meshes[1].material = 1;
  // Turned, so that coordinates are rounded.
  for (Object& object : model.objects)
    object.worldFromMesh = Eigen::AngleAxisd(0.3, Vec3(1, 2, 3).normalized());
  const SceneReport report = makeSceneReport(Scene(std::move(model)));
  if (countDiagnostics(report, "coplanar_surfaces") > 0) {
    EXPECT_EQ(findExample(report, "coplanar_surfaces"), a.path + " and " + b.path);
  }
  return countDiagnostics(report, "coplanar_surfaces");
}

TEST(SceneReport, SurfacesOfTwoObjectsInOnePlaneAreCountedIfTheyFlicker) {
  const testing::NamedBox slab{"slab", {0, 0, 0}, {4, 0.3, 4}};
  const testing::NamedBox rafter{"rafter", {1, 0, 0.5}, {1.2, 0.2, 3.5}};
  EXPECT_EQ(countCoplanar(slab, rafter, true), 1u);
  EXPECT_EQ(countCoplanar(slab, rafter, false), 0u) << "of one colour";
  EXPECT_EQ(countCoplanar(slab, {"deeper", {1, 0.001, 0.5}, {1.2, 0.2, 3.5}}, true), 0u);
  EXPECT_EQ(countCoplanar(slab, {"below", {1, -1, 0.5}, {2, 0, 3.5}}, true), 0u)
      << "faces of opposite sides";
  EXPECT_EQ(countCoplanar(slab, {"next", {4, 0, 0}, {8, 0.3, 4}}, true), 0u);
  EXPECT_EQ(findDiagnosticKind({"coplanar_surfaces", 1, ""}).severity, Severity::note);
}

/// A model of boxes of two colours: the second colour is that of the boxes from `firstRed` on.
Model makeTwoColoured(const std::vector<testing::NamedBox>& boxes, std::size_t firstRed) {
  Model model = testing::makeBoxModel(boxes);
  model.materials.emplace_back();
  model.materials[1].baseColour = {1, 0, 0, 1};
  for (std::size_t i = firstRed; i < boxes.size(); ++i) model.meshes[i].material = 1;
  return model;
}

TEST(SceneReport, CoplanarPairsAreCountedOnceEachAndTheLargestIsTheExample) {
  // Most rafters share several planes with the slab. The wide one is found neither first nor last.
  const CoplanarSurfaces found =
      findCoplanarSurfaces(makeTwoColoured({{"slab", {0, 0, 0}, {4, 0.3, 4}},
                                            {"far", {20, 0, 0}, {24, 0.3, 4}},
                                            {"narrow", {0.5, 0, 0}, {0.7, 0.2, 3.5}},
                                            {"wide", {1, 0, 0.2}, {3, 0.2, 4}},
                                            {"short", {3.05, 0, 3}, {3.6, 0.28, 4}},
                                            {"on far", {21, 0, 1}, {22, 0.2, 2}}},
                                           2));
  EXPECT_EQ(found.countDifferentLooks(), 4u);
  EXPECT_EQ(found.example, "slab and wide");
  EXPECT_TRUE(found.isComplete);
}

TEST(SceneReport, CoplanarPairsAmongManyAreThoseOfEachPairAlone) {
  // Boxes on a grid of half metres, of which many touch and some touch only smaller ones.
  constexpr std::size_t kCount = 80, kFirstRed = 40;
  std::mt19937 random(7);
  const auto pick = [&](unsigned from, unsigned to) {
    return 0.5 * static_cast<double>(from + random() % (to - from + 1));
  };
  std::vector<testing::NamedBox> boxes;
  for (std::size_t i = 0; i < kCount; ++i) {
    const Vec3 min(pick(0, 16), pick(0, 8), pick(0, 16));
    boxes.push_back({"box", min, min + Vec3(pick(1, 4), pick(1, 4), pick(1, 4))});
  }
  std::map<std::pair<std::uint32_t, std::uint32_t>, bool> found, expected;
  for (const CoplanarPair& pair : findCoplanarSurfaces(makeTwoColoured(boxes, kFirstRed)).pairs)
    found[{pair.first, pair.second}] = pair.looksEqual;
  for (std::uint32_t i = 0; i < kCount; ++i) {
    for (std::uint32_t j = i + 1; j < kCount; ++j) {
      const std::size_t firstRed = i >= kFirstRed ? 0 : j >= kFirstRed ? 1 : 2;
      const auto alone =
          findCoplanarSurfaces(makeTwoColoured({boxes[i], boxes[j]}, firstRed)).pairs;
      if (!alone.empty()) expected[{i, j}] = alone[0].looksEqual;
    }
  }
  EXPECT_EQ(found, expected);
  EXPECT_GT(found.size(), 30u);
  EXPECT_LT(found.size(), 500u);
}

TEST(SceneReport, CoplanarSurfacesBeyondTheLimitOfTrianglesAreLeftOut) {
  const Model model = makeTwoColoured({{"slab", {0, 0, 0}, {4, 0.3, 4}},
                                       {"a", {1, 0, 1}, {2, 0.2, 2}},
                                       {"b", {3, 0, 3}, {4, 0.2, 4}}},
                                      1);
  const CoplanarSurfaces all = findCoplanarSurfaces(model, 36);  // a box has twelve
  EXPECT_TRUE(all.isComplete);
  EXPECT_EQ(all.pairs.size(), 2u);
  const CoplanarSurfaces some = findCoplanarSurfaces(model, 35);
  EXPECT_FALSE(some.isComplete);
  ASSERT_EQ(some.pairs.size(), 1u);
  EXPECT_EQ(some.pairs[0], (CoplanarPair{0, 1, false}));
}

TEST(SceneReport, ASearchForCoplanarSurfacesThatEndsEarlyIsReported) {
  const auto report = [](std::size_t tiles, bool isRafterRed = true) {
    std::vector<testing::NamedBox> boxes{{"slab", {-1, 0, 0}, {4, 0.3, 4}}};
    for (std::size_t i = 0; i < tiles; ++i) {
      const double z = 5 + 0.5 * static_cast<double>(i);  // each touches the next
      boxes.push_back({"tile", {0, 0, z}, {0.5, 0.3, z + 0.5}});
    }
    boxes.push_back({"rafter", {0, 0, 1}, {0.5, 0.2, 2}});
    const std::size_t firstRed = boxes.size() - (isRafterRed ? 1 : 0);
    return makeSceneReport(Scene(makeTwoColoured(boxes, firstRed)));
  };
  // n tiles have 2 n triangles in each of the two planes of their ends: 4 n^2 comparisons.
  const SceneReport few = report(100), many = report(1500), manyAlike = report(1500, false);
  EXPECT_EQ(countDiagnostics(few, "coplanar_surfaces"), 1u);
  EXPECT_EQ(findExample(few, "coplanar_surfaces"), "slab and rafter");
  EXPECT_EQ(countDiagnostics(many, "coplanar_surfaces"), 1u);
  EXPECT_EQ(countDiagnostics(manyAlike, "coplanar_surfaces"), 0u);
  EXPECT_EQ(countDiagnostics(few, "coplanar_search_ended"), 0u);
  EXPECT_EQ(countDiagnostics(many, "coplanar_search_ended"), 1u);
  EXPECT_EQ(countDiagnostics(manyAlike, "coplanar_search_ended"), 1u);
}

TEST(SceneReport, SpacesThatAreAirAreNotedAndNothingIsWrongWithThem) {
  EXPECT_EQ(findDiagnosticKind({"skipped_spaces", 3, "hall"}).severity, Severity::note);
  EXPECT_EQ(findDiagnosticKind({"skipped_openings", 1, "door's"}).severity, Severity::note);
  EXPECT_EQ(findDiagnosticKind({"uncut_opening", 1, "door"}).severity, Severity::error);
  EXPECT_NE(findDiagnosticKind({"uncut_opening", 1, "door"}).meaning, "");
  EXPECT_EQ(findDiagnosticKind({"of_a_later_version", 1, ""}).meaning, "");
}

}  // namespace
}  // namespace enfilade::scene
