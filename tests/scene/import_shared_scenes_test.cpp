// Real files, against the table of objects, triangles and true extents that comes with them.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "scene/import_model.hpp"
#include "scene/scene.hpp"
#include "tests/support/shared_folder.hpp"

namespace enfilade::scene {
namespace {

struct Expected {
  const char* file;
  std::size_t objects;
  std::size_t triangles;  ///< of all placements
  Vec3 extents;           ///< metres
  double metresPerUnit;
  char up;
  double given = 0;  ///< --unit, 0: none
};

// IFC objects are products: nodes of mapped items belong to the product above them.
const Expected kScenes[] = {
    {"fzk-haus/AC14-FZK-Haus.ifc", 110, 35906, {18.0, 7.318, 16.0}, 1, 'z'},
    {"duplex/Duplex_A_20110907.ifc", 215, 25489, {9.283, 8.185, 26.565}, 1, 'z'},
    {"duplex/Duplex_Electrical_20121207.ifc", 103, 30158, {8.481, 6.757, 17.258}, 0.3048, 'z'},
    {"duplex/duplex_utm32.glb", 665, 55647, {9.283, 8.307, 26.565}, 1, 'y'},
    {"aws-small-house/small_house.gltf", 108, 145844, {19.0, 3.001, 11.4}, 1, 'y'},
    {"willow-garage/meshes/willowgarage_visual.dae", 2, 13839, {58.626, 2.845, 48.62}, 0.0254, 'z'},
    {"cpr-office/office.dae", 57, 3790, {44.01, 2.515, 25.447}, 1, 'z'},
    {"cpr-office/cpr_office_ascii.fbx", 57, 3790, {44.01, 2.515, 25.447}, 1, 'y'},
    {"pandora/pandora.obj", 206, 60810, {1472, 448, 832}, 1, 'y'},
    {"pandora/pandora.obj", 206, 60810, {73.6, 22.4, 41.6}, 0.05, 'y', 0.05},
    {"schependomlaan/LINDEN_-_Kozijnen.ifc", 1438, 152892, {23.038, 11.712, 21.3}, 0.001, 'z'},
    {"schependomlaan/schependomlaan_block.glb", 3279, 213667, {23.926, 13.69, 24.38}, 1, 'y'},
    {"schependomlaan/schependomlaan_estate.glb", 16395, 1068335, {121.306, 13.69, 91.76}, 1, 'y'},
    {"single-rooms/vr-gallery.glb", 1, 1930, {10.115, 5.054, 10.118}, 1, 'y'},
    {"single-rooms/spheres-room.glb", 17, 63720, {10.0, 5.0, 10.0}, 1, 'y'},
};

Model importShared(const std::filesystem::path& shared, const Expected& expected) {
  ImportOptions options;
  if (expected.given > 0) options.metresPerUnit = expected.given;
  return importModel(shared / "scenes" / expected.file, options);
}

std::size_t placedTriangles(const Model& model) {
  std::size_t triangles = 0;
  for (const Object& object : model.objects) {
    for (const std::uint32_t mesh : object.meshes) {
      triangles += model.meshes[mesh].indices.size() / 3;
    }
  }
  return triangles;
}

std::size_t countOf(const Model& model, const std::string& kind) {
  for (const Problem& problem : model.problems) {
    if (problem.kind == kind) return problem.count;
  }
  return 0;
}

TEST(ImportSharedScenes, EachGivesItsObjectsTrianglesAndTrueExtents) {
  ENFILADE_NEED_SHARED(shared);
  for (const Expected& expected : kScenes) {
    SCOPED_TRACE(expected.file);
    Model model = importShared(*shared, expected);
    EXPECT_EQ(model.objects.size(), expected.objects);
    EXPECT_EQ(placedTriangles(model), expected.triangles);
    EXPECT_NEAR(model.metresPerUnit, expected.metresPerUnit, 1e-6);
    EXPECT_EQ(model.up, expected.up);
    std::set<std::string> paths;
    for (const Object& object : model.objects) paths.insert(object.path);
    EXPECT_EQ(paths.size(), expected.objects) << "paths repeat";
    const Scene scene(std::move(model));
    const Vec3 error = scene.bounds().size() - expected.extents;
    EXPECT_LT(error.cwiseAbs().maxCoeff(), 1.5e-3) << scene.bounds().size().transpose();
  }
}

TEST(ImportSharedScenes, ColladaAndFbxOfTheSameOfficeAreTheSameWorld) {
  ENFILADE_NEED_SHARED(shared);
  const Scene dae(importModel(*shared / "scenes/cpr-office/office.dae"));
  const Scene fbx(importModel(*shared / "scenes/cpr-office/cpr_office_ascii.fbx"));
  EXPECT_LT((dae.bounds().min - fbx.bounds().min).norm(), 1e-4);
  EXPECT_LT((dae.bounds().max - fbx.bounds().max).norm(), 1e-4);
  EXPECT_EQ(countOf(fbx.model(), "unit_assumed"), 1u);
  // The same boxes, whatever the order.
  ASSERT_EQ(dae.stillBoxes().size(), fbx.stillBoxes().size());
  for (const Box& box : dae.stillBoxes()) {
    const auto same =
        std::any_of(fbx.stillBoxes().begin(), fbx.stillBoxes().end(), [&](const Box& other) {
          return (box.min - other.min).norm() < 1e-3 && (box.max - other.max).norm() < 1e-3;
        });
    EXPECT_TRUE(same) << box.min.transpose();
  }
}

TEST(ImportSharedScenes, ElectricalFixturesInFeetLieInsideTheirBuilding) {
  ENFILADE_NEED_SHARED(shared);
  const Scene house(importModel(*shared / "scenes/duplex/Duplex_A_20110907.ifc"));
  const Scene fixtures(importModel(*shared / "scenes/duplex/Duplex_Electrical_20121207.ifc"));
  const Box room = grown(house.bounds(), 0.2);
  EXPECT_TRUE((fixtures.bounds().min.array() >= room.min.array()).all());
  EXPECT_TRUE((fixtures.bounds().max.array() <= room.max.array()).all());
}

TEST(ImportSharedScenes, FarAwayBuildingKeepsTheShapesOfTheNearOne) {
  ENFILADE_NEED_SHARED(shared);
  const Model far = importModel(*shared / "scenes/duplex/duplex_utm32.glb");
  EXPECT_EQ(far.offset.x(), std::round(far.offset.x()));
  EXPECT_NEAR(far.offset.x(), 459123.4, 10);
  EXPECT_NEAR(far.offset.z(), -5428310.7, 20);
  const Scene farScene{Model(far)};
  const Scene near(importModel(*shared / "scenes/duplex/Duplex_A_20110907.ifc"));
  // Composed in floats, widths at five thousand kilometres would be multiples of half a metre.
  // The far file has a node for each mesh, so only objects of one mesh can be compared.
  std::size_t compared = 0;
  for (std::size_t i = 0; i < near.stillBoxes().size(); ++i) {
    if (near.model().objects[near.solidObjects()[i]].meshes.size() != 1) continue;
    ++compared;
    const Vec3 size = near.stillBoxes()[i].size();
    const auto same =
        std::any_of(farScene.stillBoxes().begin(), farScene.stillBoxes().end(),
                    [&](const Box& other) { return (size - other.size()).norm() < 1e-3; });
    EXPECT_TRUE(same) << size.transpose();
  }
  EXPECT_GT(compared, 100u);
}

TEST(ImportSharedScenes, IfcProductsKeepTheirGlobalIds) {
  ENFILADE_NEED_SHARED(shared);
  const Model model = importModel(*shared / "scenes/duplex/Duplex_A_20110907.ifc");
  std::set<std::string> ids;
  for (const Object& object : model.objects) {
    EXPECT_EQ(object.globalId.size(), 22u) << object.path;
    ids.insert(object.globalId);
    const std::string name = object.path.substr(object.path.rfind('/') + 1);
    EXPECT_FALSE(name.starts_with("IfcSpace_")) << name;  // furniture may stand in one
  }
  EXPECT_EQ(ids.size(), model.objects.size());
  EXPECT_EQ(countOf(model, "skipped_spaces"), 21u);
}

TEST(ImportSharedScenes, TexturesThatAreThereAreReadAndOthersCounted) {
  ENFILADE_NEED_SHARED(shared);
  const Model model = importModel(*shared / "scenes/aws-small-house/small_house.gltf");
  EXPECT_EQ(model.textures.size(), 83u);
  EXPECT_EQ(countOf(model, "missing_texture"), 2u);
  for (const Texture& texture : model.textures) {
    EXPECT_EQ(texture.rgba.size(), std::size_t{4} * texture.width * texture.height);
    EXPECT_LE(std::max(texture.width, texture.height), 1024u);
  }
}

TEST(ImportSharedScenes, MirroredBlocksAreReported) {
  ENFILADE_NEED_SHARED(shared);
  const Model model = importModel(*shared / "scenes/schependomlaan/schependomlaan_estate.glb");
  EXPECT_EQ(countOf(model, "mirrored_object"), 6558u);
}

TEST(ImportSharedScenes, TwoImportsGiveTheSameHash) {
  ENFILADE_NEED_SHARED(shared);
  const auto file = *shared / "scenes/fzk-haus/AC14-FZK-Haus.ifc";
  EXPECT_EQ(Scene(importModel(file)).hash(), Scene(importModel(file)).hash());
}

TEST(ImportSharedScenes, HardFilesEndInErrorsThatNameThem) {
  ENFILADE_NEED_SHARED(shared);
  std::size_t tried = 0;
  for (const char* folder : {"scenes/hard-imports", "scenes/schependomlaan"}) {
    for (const auto& entry : std::filesystem::directory_iterator(*shared / folder)) {
      const std::string extension = entry.path().extension().string();
      const bool hard = std::string(folder) == "scenes/hard-imports"
                            ? extension == ".ifc" || extension == ".dae"
                            : extension == ".ifczip";
      if (!hard) continue;
      ++tried;
      try {
        importModel(entry.path());
        ADD_FAILURE() << entry.path() << " was read";
      } catch (const ImportError& error) {
        EXPECT_NE(std::string(error.what()).find(entry.path().filename().string()),
                  std::string::npos)
            << error.what();
      }
    }
  }
  EXPECT_EQ(tried, 8u);
}

}  // namespace
}  // namespace enfilade::scene
