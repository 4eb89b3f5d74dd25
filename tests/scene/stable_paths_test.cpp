// Tests that a model exported again keeps its object names where the modeller kept them.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "scene/import/import_model.hpp"
#include "scene/world/data/scene.hpp"
#include "scene/world/queries/scene_report.hpp"
#include "tests/scene/hand_made_files.hpp"

namespace enfilade::scene {
namespace {

using tests::BoxMesh;
using tests::makeGltfFile;
using tests::TemporaryFolder;

/// Position of each object by path.
std::map<std::string, Vec3> computePlaces(const Model& model) {
  const Scene scene{Model(model)};
  std::map<std::string, Vec3> places;
  for (std::uint32_t i = 0; i < model.objects.size(); ++i)
    places[model.objects[i].path] = computeAuthoredAabb(scene, i).min + model.offset;
  return places;
}

std::string makeNode(const std::string& name, int x, const std::string& more = "") {
  return R"({"name":")" + name + R"(","mesh":0,"translation":[)" + std::to_string(x) + ",0,0]" +
         more + "}";
}

std::map<std::string, Vec3> importPlaces(const TemporaryFolder& folder, const std::string& roots,
                                         const std::string& nodes) {
  return computePlaces(
      importModel(folder.write("model.gltf", makeGltfFile(BoxMesh({1, 1, 1}), roots, nodes))));
}

TEST(StablePaths, AnotherOrderOfNodesAndAnotherNumberingChangeNothing) {
  const TemporaryFolder folder;
  const auto first =
      importPlaces(folder, "0",
                   R"({"name":"hall","children":[1,2]},)" + makeNode("door", 3) + "," +
                       makeNode("table", 7, R"(,"children":[3])") + "," + makeNode("lamp", 1));
  const auto again = importPlaces(folder, "3",
                                  makeNode("lamp", 1) + "," + makeNode("door", 3) + "," +
                                      makeNode("table", 7, R"(,"children":[0])") +
                                      R"(,{"name":"hall","children":[2,1]})");
  ASSERT_EQ(first.size(), 3u);
  EXPECT_EQ(first, again);
  EXPECT_TRUE(first.contains("hall/table/lamp"));
}

TEST(StablePaths, NewSiblingsAndNamelessOnesKeepOtherNames) {
  const TemporaryFolder folder;
  const auto first =
      importPlaces(folder, "0,1,2",
                   makeNode("chair", 1) + "," + makeNode("chair", 2) + "," + makeNode("desk", 3));
  const auto again = importPlaces(folder, "0,1,2,3,4",
                                  R"({"mesh":0,"translation":[9,0,0]},)" + makeNode("plant", 8) +
                                      "," + makeNode("chair", 1) + "," + makeNode("chair", 2) +
                                      "," + makeNode("desk", 3));
  ASSERT_EQ(first.size(), 3u);
  for (const auto& [path, place] : first) {
    ASSERT_TRUE(again.contains(path)) << path;
    EXPECT_EQ(again.at(path), place) << path;
  }
  EXPECT_TRUE(first.contains("chair#2"));
}

TEST(StablePaths, RepeatsBelowOneParentLeaveThoseBelowAnotherAlone) {
  const TemporaryFolder folder;
  const auto paths =
      importPlaces(folder, "0,1",
                   R"({"name":"north","children":[2]},{"name":"south","children":[3,4]},)" +
                       makeNode("bed", 1) + "," + makeNode("bed", 2) + "," + makeNode("bed", 3));
  EXPECT_TRUE(paths.contains("north/bed"));
  EXPECT_TRUE(paths.contains("south/bed"));
  EXPECT_TRUE(paths.contains("south/bed#2"));
}

TEST(StablePaths, AMeshThatManyNodesUseIsStoredOnce) {
  const TemporaryFolder folder;
  std::string nodes, roots;
  for (int i = 0; i < 400; ++i) {
    nodes += (i == 0 ? "" : ",") + makeNode("chair", i);
    roots += (i == 0 ? "" : ",") + std::to_string(i);
  }
  const Model model =
      importModel(folder.write("model.gltf", makeGltfFile(BoxMesh({1, 1, 1}), roots, nodes)));
  EXPECT_EQ(model.objects.size(), 400u);
  EXPECT_EQ(model.meshes.size(), 1u);
  EXPECT_EQ(Scene{Model(model)}.shapeCount(), 1u);
}

}  // namespace
}  // namespace enfilade::scene
