#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <gtest/gtest.h>

#include <assimp/Importer.hpp>
#include <cstring>

#include "assets/building.hpp"
#include "assets/glb_writer.hpp"
#include "assets/maker.hpp"

namespace enfilade::assets {
namespace {

const std::string& getBuildingBytes() {
  static const std::string bytes = [] {
    std::vector<MovingPart> parts;
    const scene::Model model = makeBuilding({}, &parts);
    return encodeGlb(model, parts);
  }();
  return bytes;
}

std::uint32_t readWordAt(const std::string& bytes, std::size_t offset) {
  std::uint32_t word = 0;
  std::memcpy(&word, bytes.data() + offset, 4);
  return word;
}

int runMakerWith(std::vector<const char*> arguments, std::vector<MakerArguments>& made) {
  arguments.insert(arguments.begin(), "maker");
  return runMaker(static_cast<int>(arguments.size()), arguments.data(), "usage: maker",
                  [&](const MakerArguments& parsed) {
                    if (parsed.file == "full") throw std::runtime_error("disk full");
                    made.push_back(parsed);
                  });
}

std::uint64_t computeFnv1a(const std::string& bytes) {
  std::uint64_t hash = 0xcbf29ce484222325u;
  for (const char c : bytes) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
  return hash;
}

TEST(Maker, ParsesFileNumberAndSeed) {
  std::vector<MakerArguments> made;
  EXPECT_EQ(runMakerWith({"a.glb"}, made), 0);
  EXPECT_EQ(runMakerWith({"b.glb", "7000", "3"}, made), 0);
  ASSERT_EQ(made.size(), 2u);
  EXPECT_FALSE(made[0].number || made[0].seed);
  EXPECT_EQ(made[1].file, "b.glb");
  EXPECT_EQ(made[1].number, 7000u);
  EXPECT_EQ(made[1].seed, 3u);
  for (const std::vector<const char*>& bad : std::vector<std::vector<const char*>>{
           {}, {"a", "many"}, {"a", "-1"}, {"a", "1.5"}, {"a", "1", ""}, {"a", "1", "2", "3"}})
    EXPECT_EQ(runMakerWith(bad, made), 2) << ::testing::PrintToString(bad);
  EXPECT_EQ(runMakerWith({"-o"}, made), 2);
  EXPECT_EQ(runMakerWith({"--help", "7000"}, made), 2);
  EXPECT_EQ(runMakerWith({"--help"}, made), 0);
  EXPECT_EQ(runMakerWith({"full"}, made), 1);
  EXPECT_EQ(made.size(), 2u);
}

TEST(Glb, IsTheSameFromRunToRunAndFromCompilerToCompiler) {
  std::vector<MovingPart> parts;
  const scene::Model again = makeBuilding({}, &parts);
  EXPECT_EQ(encodeGlb(again, parts), getBuildingBytes());
  // Pinned hash: a deliberate change of the building changes it.
  EXPECT_EQ(computeFnv1a(getBuildingBytes()), 0xfafad81e048108c7u)
      << std::hex << computeFnv1a(getBuildingBytes());
}

TEST(Glb, DiffersWithTheSeed) {
  EXPECT_NE(encodeGlb(makeBuilding({2, 0})), encodeGlb(makeBuilding({3, 0})));
}

TEST(Glb, HasAWellFormedHeaderAndStaysSmall) {
  const std::string& glb = getBuildingBytes();
  EXPECT_LT(glb.size(), 20u << 20);
  EXPECT_EQ(glb.substr(0, 4), "glTF");
  EXPECT_EQ(readWordAt(glb, 4), 2u);
  EXPECT_EQ(readWordAt(glb, 8), glb.size());
  const std::uint32_t json = readWordAt(glb, 12);
  EXPECT_EQ(glb.substr(16, 4), "JSON");
  EXPECT_EQ(json % 4, 0u);
  EXPECT_EQ(glb.substr(20 + json + 4, 4), std::string("BIN\0", 4));
  EXPECT_EQ(20 + json + 8 + readWordAt(glb, 20 + json), glb.size());
  EXPECT_NE(glb.find("\"walk_kind\":\"hinged\""), std::string::npos);
  EXPECT_NE(glb.find("\"walk_kind\":\"sliding\""), std::string::npos);
  EXPECT_NE(glb.find("\"walk_kind\":\"lift\""), std::string::npos);
}

struct Count {
  std::size_t objects = 0, triangles = 0;
  bool operator==(const Count&) const = default;
};

Count countObjects(const aiScene& scene, const aiNode& node) {
  Count count{node.mNumMeshes > 0, 0};
  for (unsigned i = 0; i < node.mNumMeshes; ++i)
    count.triangles += scene.mMeshes[node.mMeshes[i]]->mNumFaces;
  for (unsigned i = 0; i < node.mNumChildren; ++i) {
    const Count child = countObjects(scene, *node.mChildren[i]);
    count.objects += child.objects;
    count.triangles += child.triangles;
  }
  return count;
}

TEST(Glb, IsReadBackByAssimpWithAllItsObjectsAndTriangles) {
  Assimp::Importer importer;
  const aiScene* scene =
      importer.ReadFileFromMemory(getBuildingBytes().data(), getBuildingBytes().size(), 0, "glb");
  ASSERT_NE(scene, nullptr) << importer.GetErrorString();
  const scene::Model model = makeBuilding();
  Count expected{model.objects.size(), 0};
  for (const scene::Object& object : model.objects)
    for (std::uint32_t mesh : object.meshes)
      expected.triangles += model.meshes[mesh].indices.size() / 3;
  EXPECT_EQ(countObjects(*scene, *scene->mRootNode).objects, expected.objects);
  EXPECT_EQ(countObjects(*scene, *scene->mRootNode).triangles, expected.triangles);
}

TEST(Glb, KeepsAnObjectThatLiesUnderAnotherInPlace) {
  scene::Model model;
  model.materials.resize(1);
  scene::Mesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.indices = {0, 1, 2};
  model.meshes = {mesh};
  scene::Object parent, child;
  parent.path = "door";
  parent.meshes = child.meshes = {0};
  parent.worldFromMesh.translation() = collision::Vec3{2, 0, 0};
  child.path = "door/handle";
  child.worldFromMesh.translation() = collision::Vec3{3, 1, 0};
  model.objects = {parent, child};
  Assimp::Importer importer;
  const std::string glb = encodeGlb(model);
  const aiScene* scene = importer.ReadFileFromMemory(glb.data(), glb.size(), 0, "glb");
  ASSERT_NE(scene, nullptr) << importer.GetErrorString();
  const aiNode* handle = scene->mRootNode->FindNode("handle");
  ASSERT_NE(handle, nullptr);
  EXPECT_EQ(handle->mTransformation.a4, 1);
  EXPECT_EQ(handle->mTransformation.b4, 1);
}

TEST(Glb, RefusesModelsBeyondTheFormatsLimits) {
  EXPECT_THROW(encodeGlb({}), std::invalid_argument);
  scene::Model duplicates;
  duplicates.meshes.resize(1);
  duplicates.meshes[0].positions.resize(3);
  duplicates.meshes[0].indices = {0, 1, 2};
  duplicates.objects.resize(2);
  for (scene::Object& object : duplicates.objects) {
    object.path = "same";
    object.meshes = {0};
  }
  EXPECT_THROW(encodeGlb(duplicates), std::invalid_argument);
  EXPECT_THROW(writeGlb("/nowhere/at/all.glb", makeBuilding()), std::runtime_error);
}

}  // namespace
}  // namespace enfilade::assets
