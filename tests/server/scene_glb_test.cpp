// Tests of the scene as binary glTF: every object is there once, where the model has it.
#include "server/export/scene_glb.hpp"

#include <algorithm>
#include <map>

#include "server/export/draw_groups.hpp"
#include "tests/scene/box_scene.hpp"
#include "tests/server/body_room.hpp"
#include "tests/server/glb_reader.hpp"

namespace enfilade::server::testing {
namespace {

using scene::Model;
using scene::Scene;
using scene::Vec3;

constexpr double kFloatError = 1e-6;  // relative, of a coordinate in single precision

Model makeBoxes(std::size_t count) {
  std::vector<scene::testing::NamedBox> named;
  for (std::size_t i = 0; i < count; ++i) {
    const double x = 2.0 * static_cast<double>(i);
    named.push_back({"box" + std::to_string(i), {x, 0, 0}, {x + 1, 1, 1}});
  }
  return scene::testing::makeBoxModel(named);
}

Eigen::Affine3d makePlacement(int i) {
  return Eigen::Translation3d(1.5 * i, 0.25 * i, -3) *
         Eigen::AngleAxisd(0.4 * i, Vec3(1, 2, 3).normalized()) *
         Eigen::Scaling(Vec3(1, 1 + 0.1 * i, 0.5));
}

Eigen::Affine3d makeShear() {
  Eigen::Affine3d transform = Eigen::Affine3d::Identity();
  transform.linear()(0, 1) = 0.5;
  return transform;
}

/// One mesh at ten placements, then mirrored, sheared and as in the model.
Model makeRepeatedBox() {
  Model model = makeBoxes(1);
  model.objects.clear();
  for (int i = 0; i < 10; ++i)
    model.objects.push_back({"copy" + std::to_string(i), "", {0}, makePlacement(i)});
  model.objects.push_back({"mirrored", "", {0}, Eigen::Affine3d(Eigen::Scaling(-1.0, 1.0, 1.0))});
  model.objects.push_back({"sheared", "", {0}, makeShear()});
  return model;
}

/// Compares the drawn triangles of each entity with the model's, corner by corner.
void expectTheModelsTriangles(const GlbReader& file, const Model& model) {
  std::map<std::uint32_t, std::vector<GlbReader::Triangle>> drawn;
  for (const auto& triangle : file.collectDrawnTriangles())
    drawn[triangle.entity].push_back(triangle);
  const std::vector<bool> isDrawn = findDrawnObjects(model);
  for (std::uint32_t i = 0; i < model.objects.size(); ++i) {
    const scene::Object& object = model.objects[i];
    const auto& own = drawn[i + 1];
    std::size_t at = 0;
    for (const std::uint32_t index : object.meshes) {
      const scene::Mesh& mesh = model.meshes[index];
      for (std::size_t t = 0; isDrawn[i] && t < mesh.triangleCount(); ++t, ++at) {
        ASSERT_LT(at, own.size()) << object.path;
        const bool mirrors = object.worldFromMesh.linear().determinant() < 0;
        for (std::size_t c = 0; c < 3; ++c) {
          const std::size_t corner = 3 * t + (mirrors && c > 0 ? 3 - c : c);
          const Vec3 wanted = computeWorldPosition(object, mesh, mesh.indices[corner]);
          EXPECT_LE((own[at].corners[c] - wanted).norm(), kFloatError * (1 + wanted.norm()))
              << object.path << " triangle " << t;
        }
      }
    }
    EXPECT_EQ(at, own.size()) << object.path;
  }
}

/// Ids of all static objects in the extras of the nodes, with repetitions.
std::vector<std::uint32_t> listEntities(const GlbReader& file) {
  std::vector<std::uint32_t> ids;
  for (const auto& node : file.json.at("nodes")) {
    const auto& extras = node.at("extras");
    if (!extras.contains("entities")) continue;
    for (const std::uint32_t id : extras.at("entities")) ids.push_back(id);
  }
  std::sort(ids.begin(), ids.end());
  return ids;
}

TEST(SceneGlb, StaticObjectsAreMergedByMaterial) {
  Model model = makeBoxes(30);
  model.materials.resize(3);
  model.materials[1].baseColour.x() = 0.1f;
  model.materials[2].name = "looks like the first";
  for (std::uint32_t i = 0; i < 30; ++i) model.meshes[i].material = i % 3;
  const SceneGlb glb = writeSceneGlb(Scene(model));
  const GlbReader file(glb.bytes);
  EXPECT_EQ(glb.drawGroups, 2u);
  EXPECT_EQ(file.json.at("meshes").size(), 2u);
  EXPECT_EQ(file.json.at("materials").size(), 2u);
  EXPECT_EQ(glb.triangles, 30u * 12u);
  expectTheModelsTriangles(file, model);
  std::vector<std::uint32_t> all(30);
  for (std::uint32_t i = 0; i < 30; ++i) all[i] = i + 1;
  EXPECT_EQ(listEntities(file), all);
  for (const auto& node : file.json.at("nodes"))
    EXPECT_EQ(node.at("extras").at("entities").size(), node.at("extras").at("triangles").size());
}

TEST(SceneGlb, TheTableHasEveryObjectOnceWithWhatIsKnown) {
  Model model = makeBoxes(3);
  model.objects[1].globalId = "2O2Fr$t4X7Zf8NOew3FLOH";
  model.objects[1].ifcClass = "IfcDoor";
  model.objects[2].partOf = 1;
  model.objects[2].usage = scene::Object::Usage::collisionOnly;
  const GlbReader file(writeSceneGlb(Scene(model)).bytes);
  const auto& table = file.json.at("scenes").at(0).at("extras").at("entities");
  ASSERT_EQ(table.size(), 3u);
  EXPECT_EQ(table[0], nlohmann::json({{"id", 1}, {"path", "box0"}}));
  EXPECT_EQ(table[1].at("globalId"), "2O2Fr$t4X7Zf8NOew3FLOH");
  EXPECT_EQ(table[1].at("class"), "IfcDoor");
  EXPECT_EQ(table[2].at("partOf"), 2);
  EXPECT_EQ(table[2].at("only"), "solid");
  EXPECT_EQ(listEntities(file), (std::vector<std::uint32_t>{1, 2})) << "solid shapes are not drawn";
}

TEST(SceneGlb, TheTableHasTheRanksOfSurfacesInOnePlane) {
  const Model model = scene::testing::makeBoxModel({{"wall", {0, 0, 0}, {4, 3, 0.3}},
                                                    {"panel", {1, 1, 0.1}, {2, 2, 0.3}},
                                                    {"far", {9, 0, 0}, {10, 1, 1}}});
  const GlbReader file(writeSceneGlb(Scene(model)).bytes);
  const auto& table = file.json.at("scenes").at(0).at("extras").at("entities");
  EXPECT_EQ(table.at(0).at("coplanarRank"), 1) << "the panel is smaller, and visible";
  EXPECT_FALSE(table.at(1).contains("coplanarRank"));
  EXPECT_FALSE(table.at(2).contains("coplanarRank"));
}

TEST(SceneGlb, RepeatedMeshesAreInstancedUnlessMirroredOrSheared) {
  const Model model = makeRepeatedBox();
  const SceneGlb glb = writeSceneGlb(Scene(model));
  const GlbReader file(glb.bytes);
  EXPECT_EQ(glb.drawGroups, 2u);
  EXPECT_EQ(file.json.at("extensionsRequired"), nlohmann::json({"EXT_mesh_gpu_instancing"}));
  const auto& node = file.json.at("nodes").at(1);
  const auto instances = file.readInstances(node);
  ASSERT_EQ(instances.size(), 10u);
  EXPECT_EQ(node.at("extras").at("entities").size(), 10u);
  for (const auto& [entity, transform] : instances) {
    const Eigen::Affine3d& wanted = model.objects[entity - 1].worldFromMesh;
    const double size = wanted.matrix().cwiseAbs().maxCoeff();
    EXPECT_LE((transform.matrix() - wanted.matrix()).cwiseAbs().maxCoeff(), kFloatError * size);
  }
  expectTheModelsTriangles(file, model);
  EXPECT_EQ(listEntities(file).size(), 12u);
}

TEST(SceneGlb, MirroredObjectsKeepTheirOutside) {
  const GlbReader file(writeSceneGlb(Scene(makeRepeatedBox())).bytes);
  std::map<std::uint32_t, double> volumes;
  for (const auto& t : file.collectDrawnTriangles())
    volumes[t.entity] += t.corners[0].dot(t.corners[1].cross(t.corners[2])) / 6;
  EXPECT_NEAR(volumes.at(11), 1, 1e-5) << "mirrored";
  EXPECT_NEAR(volumes.at(12), 1, 1e-5) << "sheared";
  EXPECT_NEAR(volumes.at(1), 0.5, 1e-5);
}

TEST(SceneGlb, DrawCallsDoNotGrowWithObjects) {
  Model model = makeBoxes(400);
  const std::vector<scene::Object> originals = model.objects;
  for (int copy = 1; copy < 9; ++copy)
    for (scene::Object object : originals) {
      object.path += "#" + std::to_string(copy);
      object.worldFromMesh = Eigen::Translation3d(0, 0, 3.0 * copy);
      model.objects.push_back(object);
    }
  const SceneGlb glb = writeSceneGlb(Scene(model));
  EXPECT_EQ(glb.entities, 3600u);
  EXPECT_EQ(glb.drawGroups, kMaxInstancedPrimitives + 1);
  EXPECT_EQ(glb.triangles, 3600u * 12u);
  EXPECT_EQ(GlbReader(glb.bytes).collectDrawnTriangles().size(), glb.triangles);
}

TEST(SceneGlb, BodiesAreNodesAtTheirInitialPose) {
  const Model model = makeBodyRoomModel();
  const Scene scene(model);
  const GlbReader file(writeSceneGlb(scene).bytes);
  std::map<std::string, nlohmann::json> bodies;
  for (const auto& node : file.json.at("nodes"))
    if (node.at("extras").contains("body")) bodies[node.at("extras").at("body")] = node;
  ASSERT_EQ(bodies.size(), 2u) << "a trigger volume is not drawn";
  EXPECT_EQ(bodies.at("door").at("extras").at("entity"), kLeaf);
  EXPECT_EQ(bodies.at("door").at("extras").at("kind"), "hinged");
  for (int axis = 0; axis < 3; ++axis)
    EXPECT_EQ(bodies.at("crate").at("translation").at(static_cast<std::size_t>(axis)),
              scene.bodyShape(2)->origin[axis]);
  const auto& table = file.json.at("scenes").at(0).at("extras").at("entities");
  EXPECT_EQ(table.at(kLeaf - 1).at("body"), "door");
  EXPECT_EQ(table.at(kZone - 1).at("body"), "zone");
  expectTheModelsTriangles(file, model);
}

TEST(SceneGlb, TexturesAndTransparencyAreKept) {
  Model model = makeBoxes(2);
  model.textures.push_back({"leaf", 2, 1, {10, 20, 30, 255, 40, 50, 60, 128}});
  model.materials[0].baseColourTexture = 0;
  model.materials[0].alpha = scene::Material::Alpha::mask;
  model.materials[0].doubleSided = true;
  model.meshes[0].uvs.assign(8, {0.25f, 0.75f});
  const GlbReader file(writeSceneGlb(Scene(model)).bytes);
  const auto& material = file.json.at("materials").at(0);
  EXPECT_EQ(material.at("alphaMode"), "MASK");
  EXPECT_EQ(material.at("doubleSided"), true);
  EXPECT_EQ(material.at("pbrMetallicRoughness").at("baseColorTexture").at("index"), 0);
  EXPECT_EQ(file.json.at("images").at(0).at("mimeType"), "image/png");
  EXPECT_EQ(file.readView(file.json.at("images").at(0).at("bufferView")).substr(1, 3), "PNG");
  const auto& attributes = file.json.at("meshes").at(0).at("primitives").at(0).at("attributes");
  const auto uvs = file.readNumbers<float>(attributes.at("TEXCOORD_0"));
  ASSERT_EQ(uvs.size(), 32u);
  EXPECT_EQ(uvs[1], 0.75f);
  EXPECT_EQ(uvs[17], 0) << "a mesh without coordinates shows the first texel";
}

TEST(SceneGlb, VertexColoursAreLinearAndOnlyWhereMeshesHaveThem) {
  Model model = makeBoxes(2);
  model.meshes[0].colours.assign(8, {255, 188, 0, 51});
  const GlbReader file(writeSceneGlb(Scene(model)).bytes);
  const auto& meshes = file.json.at("meshes");
  ASSERT_EQ(meshes.size(), 2u) << "one batch with colours, one without";
  std::size_t coloured = 0;
  for (const auto& mesh : meshes) {
    const auto& attributes = mesh.at("primitives").at(0).at("attributes");
    if (!attributes.contains("COLOR_0")) continue;
    ++coloured;
    EXPECT_EQ(
        file.json.at("accessors").at(attributes.at("COLOR_0").get<std::size_t>()).at("normalized"),
        true);
    const auto colours = file.readNumbers<std::uint16_t>(attributes.at("COLOR_0"));
    ASSERT_EQ(colours.size(), 32u);
    EXPECT_EQ(colours[0], 65535);
    EXPECT_NEAR(colours[1], 0.5 * 65535, 400) << "188 in sRGB is one half";
    EXPECT_EQ(colours[2], 0);
    EXPECT_EQ(colours[3], 51 * 257);
  }
  EXPECT_EQ(coloured, 1u);
}

TEST(SceneGlb, EqualTexturesAreStoredOnce) {
  Model model = makeBoxes(3);
  model.textures.assign(3, {"", 1, 1, {1, 2, 3, 255}});
  model.textures[2].rgba[0] = 9;
  model.materials.resize(4);
  for (std::uint32_t i = 0; i < 3; ++i) {
    model.materials[i].baseColourTexture = static_cast<std::int32_t>(i);
    model.meshes[i].material = i;
  }
  EXPECT_EQ(findEqualTextures(model), (std::vector<std::uint32_t>{0, 0, 2}));
  EXPECT_EQ(findEqualMaterials(model), (std::vector<std::uint32_t>{0, 0, 2, 3, 3}));
  const SceneGlb glb = writeSceneGlb(Scene(model));
  EXPECT_EQ(glb.drawGroups, 2u);
  EXPECT_EQ(GlbReader(glb.bytes).json.at("images").size(), 2u);
}

TEST(SceneGlb, NormalsAreUnitVectorsAfterScalingAndWithoutADirection) {
  Model model = makeBoxes(1);
  model.meshes[0].normals.assign(8, Eigen::Vector3f(0.6f, 0.8f, 0));
  model.meshes[0].normals[3] = Eigen::Vector3f::Zero();
  model.objects[0].worldFromMesh = Eigen::Scaling(1.0, 4.0, 1.0);
  const GlbReader file(writeSceneGlb(Scene(model)).bytes);
  const auto& attributes = file.json.at("meshes").at(0).at("primitives").at(0).at("attributes");
  const auto normals = file.readNumbers<float>(attributes.at("NORMAL"));
  for (std::size_t i = 0; i < 8; ++i) {
    const Eigen::Vector3f normal(normals[3 * i], normals[3 * i + 1], normals[3 * i + 2]);
    EXPECT_NEAR(normal.norm(), 1, 1e-6);
  }
  EXPECT_NEAR(normals[1] / normals[0], 0.2 / 0.6, 1e-6) << "scaled by the inverse";
}

TEST(SceneGlb, ManyVerticesHaveWideIndices) {
  const SceneGlb glb = writeSceneGlb(Scene(makeBoxes(8192)));  // 65,536 vertices
  const GlbReader file(glb.bytes);
  const auto& primitive = file.json.at("meshes").at(0).at("primitives").at(0);
  EXPECT_EQ(
      file.json.at("accessors").at(primitive.at("indices").get<std::size_t>()).at("componentType"),
      5125);
  EXPECT_EQ(file.collectDrawnTriangles().size(), 8192u * 12u);
}

TEST(SceneGlb, EqualScenesGiveEqualBytes) {
  EXPECT_EQ(writeSceneGlb(Scene(makeRepeatedBox())).bytes,
            writeSceneGlb(Scene(makeRepeatedBox())).bytes);
  EXPECT_EQ(writeSceneGlb(*makeBodyRoom()).bytes, writeSceneGlb(*makeBodyRoom()).bytes);
}

TEST(DrawGroups, TransformsAreDecomposed) {
  for (int i = 0; i < 10; ++i) {
    const auto trs = decomposeTrs(makePlacement(i));
    ASSERT_TRUE(trs);
    const Eigen::Affine3d again =
        Eigen::Translation3d(trs->translation) * trs->rotation * Eigen::Scaling(trs->scale);
    EXPECT_LE((again.matrix() - makePlacement(i).matrix()).norm(), 1e-12);
  }
  EXPECT_FALSE(decomposeTrs(makeShear()));
  EXPECT_FALSE(decomposeTrs(Eigen::Affine3d(Eigen::Scaling(-1.0, 1.0, 1.0))));
  EXPECT_FALSE(decomposeTrs(Eigen::Affine3d(Eigen::Scaling(0.0, 1.0, 1.0))));
}

}  // namespace
}  // namespace enfilade::server::testing
