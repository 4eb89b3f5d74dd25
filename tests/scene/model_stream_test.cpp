#include "scene/import/worker/model_stream.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <random>

namespace enfilade::scene {
namespace {

Model makeSmallModel() {
  Model model;
  model.source = "small.glb";
  model.reader = "assimp";
  model.textures.push_back({"brick", 2, 1, {1, 2, 3, 4, 5, 6, 7, 8}});
  model.materials.resize(2);
  model.materials[1].name = "glass";
  model.materials[1].alpha = Material::Alpha::blend;
  model.materials[1].doubleSided = true;
  model.materials[1].baseColourTexture = 0;
  Mesh mesh;
  mesh.name = "triangle";
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.normals.assign(3, Eigen::Vector3f::UnitZ());
  mesh.uvs = {{0, 0}, {1, 0}, {0, 1}};
  mesh.colours = {{255, 0, 0, 255}, {0, 128, 0, 255}, {1, 2, 3, 4}};
  mesh.indices = {0, 1, 2};
  mesh.material = 1;
  model.meshes.assign(2, mesh);
  Object object;
  object.path = "house/door#2";
  object.globalId = "2O2Fr$t4X7Zf8NOew3FNtn";
  object.ifcClass = "IfcDoor";
  object.operationType = "SINGLE_SWING_LEFT";
  object.overallWidth = 0.9;
  object.overallHeight = 2.1;
  object.worldFromPlacement = std::make_shared<Eigen::Affine3d>(Eigen::Translation3d(4, 5, 6));
  object.meshes = {0, 1};
  object.worldFromMesh = Eigen::Translation3d(0.1, 0.2, 0.3) * Eigen::Scaling(-1.0, 2.0, 1.0);
  object.storey = 1;
  object.attributes = {{"_COLOR_0", {0.25, 0.5, 1}}, {"_ID", {4294967295.0}}};
  model.objects.push_back(object);
  model.storeys = {{"cellar", "", -2.5}, {"ground floor", "1xS3BCk291UvhgP2dvNflr", 0.25}};
  model.spaces = {{"101", "Kitchen", "0BTBFw6f90Nfh9rP1dl_3P", 1, {{0, 0.25, 0}, {3, 2.75, 4}}},
                  {"102", "", "", std::nullopt, {}}};
  model.spaces[0].surface = {{0, 0.25, 0}, {3, 0.25, 4}, {3, 2.75, 0}};
  model.map = "EPSG:25832";
  model.north = Eigen::Vector2d(0.6, -0.8);
  model.fileScenes = {"day", "night"};
  model.fileScene = 1;
  model.metresPerUnit = 0.3048;
  model.upAxis = UpAxis::z;
  model.offset = {459123, 113, -5428311};
  model.diagnostics.push_back({"missing_texture", 3, "wall.png"});
  model.dependencies = {"small.bin", "textures/wall.png"};
  return model;
}

TEST(ModelStream, RoundTripKeepsEveryByte) {
  const std::vector<std::byte> bytes = serializeModel(makeSmallModel());
  const Model back = deserializeModel(bytes);
  EXPECT_EQ(serializeModel(back), bytes);
  EXPECT_EQ(back.objects[0].path, "house/door#2");
  EXPECT_EQ(back.objects[0].worldFromMesh.matrix(),
            makeSmallModel().objects[0].worldFromMesh.matrix());
  EXPECT_EQ(back.meshes[1].positions, makeSmallModel().meshes[1].positions);
  EXPECT_EQ(back.textures[0].rgba, makeSmallModel().textures[0].rgba);
  EXPECT_EQ(back.materials[1].alpha, Material::Alpha::blend);
  EXPECT_EQ(back.offset, makeSmallModel().offset);
  EXPECT_EQ(back.reader, "assimp");
  EXPECT_EQ(back.objects[0].ifcClass, "IfcDoor");
  EXPECT_EQ(back.objects[0].operationType, "SINGLE_SWING_LEFT");
  EXPECT_EQ(back.objects[0].overallHeight, 2.1);
  ASSERT_TRUE(back.objects[0].worldFromPlacement);
  EXPECT_EQ(back.objects[0].worldFromPlacement->translation(), Vec3(4, 5, 6));
  EXPECT_EQ(back.diagnostics[0].count, 3u);
  EXPECT_EQ(back.dependencies, makeSmallModel().dependencies);
  EXPECT_EQ(back.objects[0].storey, 1u);
  EXPECT_EQ(back.storeys[1].elevation, 0.25);
  EXPECT_EQ(back.spaces[0].longName, "Kitchen");
  EXPECT_EQ(back.spaces[0].box.max, Vec3(3, 2.75, 4));
  EXPECT_EQ(back.spaces[0].surface, makeSmallModel().spaces[0].surface);
  EXPECT_TRUE(back.spaces[1].box.empty());
  EXPECT_EQ(back.map, "EPSG:25832");
  EXPECT_EQ(back.north, Eigen::Vector2d(0.6, -0.8));
  EXPECT_EQ(back.fileScenes, (std::vector<std::string>{"day", "night"}));
  EXPECT_EQ(back.fileScene, 1u);
  EXPECT_EQ(back.meshes[0].colours, makeSmallModel().meshes[0].colours);
  EXPECT_EQ(back.objects[0].attributes, makeSmallModel().objects[0].attributes);
}

TEST(ModelStream, ColoursThatAreNotOnePerVertexAreRefused) {
  Model model = makeSmallModel();
  model.meshes[0].colours.pop_back();
  EXPECT_THROW(deserializeModel(serializeModel(model)), ModelStreamError);
}

TEST(ModelStream, ASpaceWhoseSurfaceIsCutOffOrOutsideItsBoxIsRefused) {
  Model model = makeSmallModel();
  model.spaces[0].surface[1].x() = 3.5;
  EXPECT_THROW(deserializeModel(serializeModel(model)), ModelStreamError);
  model.spaces[0].surface = {{0, 1, 0}};
  EXPECT_THROW(deserializeModel(serializeModel(model)), ModelStreamError);
}

TEST(ModelStream, AStoreyThatIsMissingIsRefused) {
  Model model = makeSmallModel();
  model.storeys.pop_back();
  EXPECT_THROW(deserializeModel(serializeModel(model)), ModelStreamError);
}

TEST(ModelStream, EveryShorterStreamIsRefused) {
  const std::vector<std::byte> bytes = serializeModel(makeSmallModel());
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    std::vector<std::byte> cut(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size));
    EXPECT_THROW(deserializeModel(cut), ModelStreamError) << size;
    if (size < 16) continue;
    const std::uint64_t length = size;  // the same with a corrected length
    std::memcpy(cut.data() + 8, &length, sizeof length);
    EXPECT_THROW(deserializeModel(cut), ModelStreamError) << size;
  }
}

/// So many objects that a second thread fetches their memory.
TEST(ModelStream, ManyObjectsAreReadOrRefusedWhereverTheStreamEnds) {
  constexpr std::size_t kObjects = 60'000;
  static_assert(kObjects * sizeof(Object) > 16 << 20);  // from here on two threads read
  Model model = makeSmallModel();
  const Object first = model.objects[0];
  while (model.objects.size() < kObjects) {
    Object& object = model.objects.emplace_back(first);
    object.path += std::to_string(model.objects.size());
    object.partOf = static_cast<std::uint32_t>(model.objects.size() / 2);
    object.thing = 0;
  }
  const std::vector<std::byte> bytes = serializeModel(model);
  EXPECT_EQ(serializeModel(deserializeModel(bytes)), bytes);
  for (const std::size_t size : {bytes.size() / 4, bytes.size() / 2, bytes.size() - 1}) {
    std::vector<std::byte> cut(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size));
    const std::uint64_t length = size;
    std::memcpy(cut.data() + 8, &length, sizeof length);
    EXPECT_THROW(deserializeModel(cut), ModelStreamError) << size;
  }
  for (const auto index : {&Object::partOf, &Object::thing}) {
    Model broken = model;
    broken.objects[100].*index = 60'000;
    EXPECT_THROW(deserializeModel(serializeModel(broken)), ModelStreamError);
  }
}

TEST(ModelStream, AnotherVersionIsRefusedByItsNumber) {
  std::vector<std::byte> bytes = serializeModel(makeSmallModel());
  bytes[4] = std::byte{99};
  try {
    deserializeModel(bytes);
    FAIL();
  } catch (const ModelStreamError& error) {
    EXPECT_NE(std::string(error.what()).find("99"), std::string::npos);
  }
}

/// Checks what a reader of the model relies on without checks.
void expectSafe(const Model& model) {
  for (const Material& m : model.materials) {
    ASSERT_LT(m.baseColourTexture, static_cast<std::int64_t>(model.textures.size()));
  }
  for (const Mesh& m : model.meshes) {
    ASSERT_LT(m.material, model.materials.size());
    for (const std::uint32_t i : m.indices) ASSERT_LT(i, m.positions.size());
  }
  for (const Object& o : model.objects) {
    ASSERT_TRUE(o.worldFromMesh.matrix().allFinite());
    for (const std::uint32_t mesh : o.meshes) ASSERT_LT(mesh, model.meshes.size());
  }
}

TEST(ModelStream, CorruptedStreamsAreRefusedOrHarmless) {
  const std::vector<std::byte> bytes = serializeModel(makeSmallModel());
  std::mt19937 random(20240607);
  const auto below = [&](std::size_t n) { return random() % n; };
  std::size_t refused = 0;
  for (int round = 0; round < 2000; ++round) {
    std::vector<std::byte> noisy = bytes;
    const std::size_t changes = 1 + below(8);
    for (std::size_t i = 0; i < changes; ++i) {
      const std::size_t at = 16 + below(noisy.size() - 16);
      noisy[at] = static_cast<std::byte>(below(256));
    }
    try {
      expectSafe(deserializeModel(noisy));
    } catch (const ModelStreamError&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 600u);
  EXPECT_LT(refused, 2000u);
}

TEST(ModelStream, AHugeCountIsRefusedBeforeAnythingIsAllocated) {
  std::vector<std::byte> bytes = serializeModel(Model());
  const std::uint64_t huge = std::uint64_t{1} << 60;
  std::memcpy(bytes.data() + 16, &huge, sizeof huge);  // the length of the source's name
  EXPECT_THROW(deserializeModel(bytes), ModelStreamError);
}

}  // namespace
}  // namespace enfilade::scene
