// Encodings of one and the same small model give the same triangles as the plain file. Damaged ones
// are errors, and counts that a file cannot justify are refused.
#include <gtest/gtest.h>
#include <webp/encode.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "scene/import/import_model.hpp"
#include "tests/scene/encoded_gltf.hpp"
#include "tests/scene/import_outcome.hpp"

namespace enfilade::scene {
namespace {

using tests::GltfWriter;
using tests::Json;
using tests::TemporaryFolder;

// ---- triangles ----------------------------------------------------------------------------------

using Triangle = std::array<Vec3, 3>;

std::vector<Triangle> listTriangles(const Model& model, const Object& object) {
  std::vector<Triangle> triangles;
  for (const std::uint32_t m : object.meshes) {
    const Mesh& mesh = model.meshes[m];
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3)
      triangles.push_back({computeWorldPosition(object, mesh, mesh.indices[i]),
                           computeWorldPosition(object, mesh, mesh.indices[i + 1]),
                           computeWorldPosition(object, mesh, mesh.indices[i + 2])});
  }
  return triangles;
}

/// The largest distance of corresponding corners; triangles may begin at any corner.
double computeDifference(const Triangle& a, const Triangle& b) {
  double best = 1e300;
  for (std::size_t first = 0; first < 3; ++first) {
    double worst = 0;
    for (std::size_t i = 0; i < 3; ++i) worst = std::max(worst, (a[i] - b[(first + i) % 3]).norm());
    best = std::min(best, worst);
  }
  return best;
}

/// Expects the same triangles with the same winding, in any order.
void expectSameTriangles(const std::vector<Triangle>& wanted, const std::vector<Triangle>& read,
                         double tolerance) {
  ASSERT_EQ(wanted.size(), read.size());
  for (const Triangle& triangle : wanted) {
    double nearest = 1e300;
    for (const Triangle& other : read)
      nearest = std::min(nearest, computeDifference(triangle, other));
    EXPECT_LE(nearest, tolerance) << triangle[0].transpose();
  }
}

std::vector<Triangle> readPlainTerrace() {
  const TemporaryFolder folder;
  const Model model = importModel(folder.write("plain.glb", tests::makePlainTerrace().toGlb()));
  return listTriangles(model, model.objects.at(0));
}

// ---- one model, many encodings ------------------------------------------------------------------

struct Encoding {
  const char* name;
  std::function<GltfWriter()> make;
  double tolerance;  ///< metres
};

void PrintTo(const Encoding& encoding, std::ostream* to) {
  *to << encoding.name;
}

std::vector<Encoding> listEncodings() {
  using tests::MeshoptOptions;
  const auto meshopt = [](MeshoptOptions options) {
    return [options] { return tests::makeMeshoptTerrace(options); };
  };
  return {
      {"Quantized", [] { return tests::makeQuantizedTerrace(false); }, 1e-9},
      {"QuantizedNormalised", [] { return tests::makeQuantizedTerrace(true); }, 1e-3},
      {"Meshopt", meshopt({}), 0},
      {"MeshoptWithFallback", meshopt({.fallback = true}), 0},
      {"MeshoptOfKhronos", meshopt({.extension = "KHR_meshopt_compression"}), 0},
      {"MeshoptVersion1", meshopt({.extension = "KHR_meshopt_compression", .version = 1}), 0},
      {"MeshoptIndexSequence", meshopt({.sequence = true}), 0},
      {"MeshoptExponential", meshopt({.exponential = true}), 1e-4},
      {"Draco", [] { return tests::makeDracoTerrace(14, false); }, 7.0 / (1 << 14)},
      {"DracoSequential", [] { return tests::makeDracoTerrace(14, true); }, 7.0 / (1 << 14)},
      {"Sparse", [] { return tests::makeSparseTerrace(true); }, 0},
      {"SparseUponZeros", [] { return tests::makeSparseTerrace(false); }, 0},
      {"Strip", tests::makeStripTerrace, 0},
      {"Fans", tests::makeFanTerrace, 0},
  };
}

class EncodedGltf : public ::testing::TestWithParam<Encoding> {};

TEST_P(EncodedGltf, GivesTheTrianglesOfThePlainFile) {
  const TemporaryFolder folder;
  const GltfWriter file = GetParam().make();
  const Model model = importModel(folder.write("encoded.glb", file.toGlb()));
  ASSERT_EQ(model.objects.size(), 1u);
  EXPECT_EQ(model.objects[0].path, "terrace");
  EXPECT_TRUE(model.diagnostics.empty()) << model.diagnostics[0].kind;
  expectSameTriangles(readPlainTerrace(), listTriangles(model, model.objects[0]),
                      GetParam().tolerance);
  // The same with the buffer in a file.
  if (file.needsPlaceholder) return;
  folder.write("data.bin", file.binary);
  const Model other = importModel(folder.write("encoded.gltf", file.toGltf("data.bin")));
  expectSameTriangles(readPlainTerrace(), listTriangles(other, other.objects.at(0)),
                      GetParam().tolerance);
}

TEST_P(EncodedGltf, DamagedAnywhereLoadsOrIsAnErrorThatNamesTheFile) {
  const TemporaryFolder folder;
  const std::string whole = GetParam().make().toGlb();
  for (std::size_t at = 20; at < whole.size(); at += 1 + whole.size() / 12) {
    std::string damaged = whole;
    damaged[at] = static_cast<char>(~damaged[at]);
    const std::string text = catchFailure(folder.write("damaged.glb", damaged));
    EXPECT_TRUE(text.empty() || text.find("damaged.glb") != std::string::npos) << text;
  }
  EXPECT_NE(catchFailure(folder.write("cut.glb", whole.substr(0, whole.size() * 2 / 3))), "");
}

std::string nameEncoding(const ::testing::TestParamInfo<Encoding>& encoding) {
  return encoding.param.name;
}

INSTANTIATE_TEST_SUITE_P(Terrace, EncodedGltf, ::testing::ValuesIn(listEncodings()), nameEncoding);

// ---- buffers in text and in files ---------------------------------------------------------------

TEST(GltfUris, NamesArePercentEncodedOrRaw) {
  const TemporaryFolder folder;
  const GltfWriter file = tests::makeQuantizedTerrace(false);
  folder.write("my data.bin", file.binary);
  folder.write("100%25.bin", file.binary);
  for (const char* uri : {"my%20data.bin", "my data.bin", "100%25.bin"}) {
    const Model model = importModel(folder.write("a.gltf", file.toGltf(uri)));
    expectSameTriangles(readPlainTerrace(), listTriangles(model, model.objects.at(0)), 1e-9);
  }
  const std::string text = catchFailure(folder.write("b.gltf", file.toGltf("lost.bin")));
  EXPECT_NE(text.find("'lost.bin' is missing"), std::string::npos) << text;
}

TEST(GltfUris, DataIsBase64OrPercentEncoded) {
  const TemporaryFolder folder;
  const GltfWriter plain = tests::makePlainTerrace();
  std::string percent = "data:application/octet-stream,";
  for (const char c : plain.binary) {
    static constexpr char kDigits[] = "0123456789abcdef";
    const auto byte = static_cast<unsigned char>(c);
    percent += {'%', kDigits[byte >> 4], kDigits[byte & 15]};
  }
  for (const GltfWriter& file : {plain, tests::makeSparseTerrace(true)}) {
    const std::string base64 =
        "data:application/octet-stream;base64," + tests::encodeBase64(file.binary);
    const Model model = importModel(folder.write("a.gltf", file.toGltf(base64)));
    expectSameTriangles(readPlainTerrace(), listTriangles(model, model.objects.at(0)), 0);
  }
  const Model model = importModel(folder.write("b.gltf", plain.toGltf(percent)));
  expectSameTriangles(readPlainTerrace(), listTriangles(model, model.objects.at(0)), 0);
}

TEST(GltfUris, DataMayHaveLineEndsAndTheAlphabetOfUrls) {
  const TemporaryFolder folder;
  const GltfWriter plain = tests::makePlainTerrace();
  std::string url = tests::encodeBase64(plain.binary);
  std::ranges::replace(url, '+', '-');
  std::ranges::replace(url, '/', '_');
  const std::string lines = "data:;BASE64," + url.insert(40, "\r\n ") + "\n";
  const Model model = importModel(folder.write("a.gltf", plain.toGltf(lines)));
  expectSameTriangles(readPlainTerrace(), listTriangles(model, model.objects.at(0)), 0);
}

TEST(GltfUris, ACharacterThatIsNotBase64IsAnError) {
  const TemporaryFolder folder;
  const GltfWriter plain = tests::makePlainTerrace();
  for (const char* foreign : {"!", "=", "%"}) {
    std::string digits = tests::encodeBase64(plain.binary);
    digits.replace(40, 1, foreign);
    const std::string text =
        catchFailure(folder.write("a.gltf", plain.toGltf("data:;base64," + digits)));
    EXPECT_NE(text.find("buffers[0]: character 41 of its data URI is not Base64"),
              std::string::npos)
        << text;
  }
}

TEST(GltfUris, AMissingOrShortBufferAndAMissingSceneAreNamed) {
  const TemporaryFolder folder;
  GltfWriter file = tests::makePlainTerrace();
  const auto model = folder.write("a.gltf", file.toGltf("a.bin"));
  const std::string missing = catchFailure(model);
  EXPECT_NE(missing.find("its buffer 'a.bin' is missing; put it next to the model"),
            std::string::npos)
      << missing;
  folder.write("a.bin", file.binary.substr(0, file.binary.size() / 2));
  const std::string cut = catchFailure(model);
  EXPECT_NE(cut.find("extends beyond its buffer of"), std::string::npos) << cut;
  folder.write("a.bin", file.binary);
  EXPECT_EQ(importModel(model).objects.size(), 1u);
  for (const char* section : {"scenes", "nodes"}) file.json.erase(section);
  const std::string bare = catchFailure(folder.write("b.gltf", file.toGltf("a.bin")));
  EXPECT_NE(bare.find("has neither a scene nor a root node; export it with one"), std::string::npos)
      << bare;
}

TEST(GltfUris, TheSchemeOfDataMayBeInCapitalLetters) {
  const TemporaryFolder folder;
  const GltfWriter plain = tests::makePlainTerrace();
  for (const char* start : {"DATA:;base64,", "Data:;BASE64,", "data:;BASE64,"}) {
    const std::string uri = start + tests::encodeBase64(plain.binary);
    const Model model = importModel(folder.write("a.gltf", plain.toGltf(uri)));
    expectSameTriangles(readPlainTerrace(), listTriangles(model, model.objects.at(0)), 0);
  }
}

TEST(GltfUris, MessagesCutLongOnes) {
  const TemporaryFolder folder;
  const std::string uri = "dota:;base64," + std::string(100'000, 'A');
  const std::string text =
      catchFailure(folder.write("a.gltf", tests::makePlainTerrace().toGltf(uri)));
  EXPECT_NE(text.find("its buffer 'dota:;base64,AAA"), std::string::npos);
  EXPECT_LT(text.size(), 400u);
}

// ---- instances ----------------------------------------------------------------------------------

TEST(GltfInstances, EachIsAnObjectWhetherTheExtensionIsRequiredOrNot) {
  const TemporaryFolder folder;
  GltfWriter nodes = tests::makePlainTerrace();
  nodes.json["nodes"] = {
      {{"name", "a"}, {"mesh", 0}},
      {{"name", "b"},
       {"mesh", 0},
       {"translation", {20, 1, 0}},
       {"rotation", {0, std::sqrt(0.5), 0, std::sqrt(0.5)}},
       {"scale", {2, 2, 2}}},
      {{"name", "c"}, {"mesh", 0}, {"translation", {40, 2, 0}}, {"scale", {1, 3, 1}}}};
  nodes.json["scenes"][0]["nodes"] = {0, 1, 2};
  const Model wanted = importModel(folder.write("nodes.glb", nodes.toGlb()));
  for (const bool required : {true, false}) {
    const GltfWriter file = tests::makeInstancedTerrace(required);
    const Model model = importModel(folder.write("instances.glb", file.toGlb()));
    ASSERT_EQ(model.objects.size(), 3u);
    EXPECT_EQ(model.meshes.size(), 1u);
    EXPECT_EQ(countDiagnostics(model, "instance_attributes_ignored"), 0u);
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_EQ(model.objects[i].path, "terrace/terrace[" + std::to_string(i) + "]");
      expectSameTriangles(listTriangles(wanted, wanted.objects[i]),
                          listTriangles(model, model.objects[i]), 1e-3);
    }
  }
}

TEST(GltfInstances, KeepTheirOwnAttributes) {
  const TemporaryFolder folder;
  GltfWriter file = tests::makeInstancedTerrace(true);
  Json& attributes = file.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"];
  const std::vector<std::uint32_t> ids{7, 4294967295, 9};
  attributes["_ID"] = file.addIndices(ids);
  const unsigned colours = file.addView(std::string("\xff\0\x33\0\0\xff\0\0\0\0\xff\0", 12));
  attributes["_COLOR_0"] = file.addAccessor(static_cast<int>(colours), 5121, 3, "VEC4", true);
  const Model model = importModel(folder.write("a.glb", file.toGlb()));
  ASSERT_EQ(model.objects.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    ASSERT_EQ(model.objects[i].attributes.size(), 2u);
    EXPECT_EQ(model.objects[i].attributes[1],
              (ObjectAttribute{"_ID", {static_cast<double>(ids[i])}}));
  }
  EXPECT_EQ(model.objects[0].attributes[0], (ObjectAttribute{"_COLOR_0", {1, 0, 0.2, 0}}));
}

TEST(GltfInstances, AttributesThatCannotBeReadAreReportedAndTheInstancesStay) {
  const TemporaryFolder folder;
  GltfWriter file = tests::makeInstancedTerrace(true);
  Json& attributes = file.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"];
  attributes["_FEW"] = file.addPoints({{1, 2, 3}});
  attributes["_ABSENT"] = 999;
  attributes["_NAN"] = file.addPoints({{NAN, 0, 0}, {0, 0, 0}, {0, 0, 0}});
  const Model model = importModel(folder.write("a.glb", file.toGlb()));
  ASSERT_EQ(model.objects.size(), 3u);
  EXPECT_EQ(countDiagnostics(model, "instance_attributes_ignored"), 3u);
  EXPECT_NE(findDiagnosticText(model, "instance_attributes_ignored").find("terrace: _ABSENT: "),
            std::string::npos);
  ASSERT_EQ(model.objects[0].attributes.size(), 1u) << "_ID";
}

TEST(GltfInstances, TheNodesOwnTransformAndChildrenStay) {
  const TemporaryFolder folder;
  GltfWriter file = tests::makeInstancedTerrace(true);
  file.json["nodes"][0]["translation"] = {0, 10, 0};
  file.json["nodes"][0]["children"] = {1};
  file.json["nodes"].push_back({{"name", "child"}, {"mesh", 0}});
  const Model model = importModel(folder.write("a.glb", file.toGlb()));
  ASSERT_EQ(model.objects.size(), 4u);
  EXPECT_EQ(model.objects[0].path, "terrace/child");
  EXPECT_EQ(model.objects[3].worldFromMesh.translation(), Vec3(40, 12, 0));
}

// ---- what is left out, and what is refused ------------------------------------------------------

TEST(GltfExtensions, WhatIsNotReadIsRefusedOrReported) {
  const TemporaryFolder folder;
  GltfWriter file = tests::makePlainTerrace();
  file.use("ACME_bent_meshes", true);
  const std::string text = catchFailure(folder.write("required.glb", file.toGlb()));
  EXPECT_NE(text.find("requires the glTF extension ACME_bent_meshes"), std::string::npos) << text;
  file.json.erase("extensionsRequired");
  file.use("KHR_materials_sheen", false);
  const Model model = importModel(folder.write("used.glb", file.toGlb()));
  EXPECT_EQ(countDiagnostics(model, "ignored_extension"), 1u);
  EXPECT_EQ(findDiagnosticText(model, "ignored_extension"), "ACME_bent_meshes");
}

TEST(GltfExtensions, UnlistedOnesAreReportedUnlessTheyChangeNoShape) {
  const TemporaryFolder folder;
  GltfWriter file = tests::makePlainTerrace();
  file.json["nodes"][0]["extras"] = {{"extensions", {{"ACME_of_the_exporter", 1}}}};
  file.json["nodes"][0]["extensions"] = {{"MOZ_hubs_components", {{"ACME_bent", 1}}}};
  file.json["meshes"][0]["extensions"] = {{"OMI_physics_body", Json::object()}};
  EXPECT_TRUE(importModel(folder.write("harmless.glb", file.toGlb())).diagnostics.empty());
  file.json["nodes"][0]["extensions"]["KHR_node_visibility"] = {{"visible", false}};
  const Model model = importModel(folder.write("hidden.glb", file.toGlb()));
  EXPECT_EQ(countDiagnostics(model, "ignored_extension"), 1u);
  EXPECT_EQ(findDiagnosticText(model, "ignored_extension"), "KHR_node_visibility");
}

TEST(GltfExtensions, ThoseThatAreRequiredAndNotReadAreRefused) {
  const TemporaryFolder folder;
  ImportOptions ignoring;
  ignoring.ignoreAppearance = true;
  for (const char* name :
       {"OMI_physics_shape", "MSFT_lod", "VRM", "AGI_articulations", "EXT_structural_metadata"}) {
    GltfWriter file = tests::makePlainTerrace();
    file.use("KHR_materials_unlit", true);
    file.use(name, true);
    const std::string text = catchFailure(folder.write("a.glb", file.toGlb()), ignoring);
    EXPECT_NE(text.find(std::string("requires the glTF extension ") + name), std::string::npos)
        << text;
  }
}

TEST(GltfExtensions, ThoseThatChangeTheAppearanceAloneAreRefusedUnlessTheUserIgnoresThem) {
  const TemporaryFolder folder;
  ImportOptions ignoring;
  ignoring.ignoreAppearance = true;
  for (const char* name : {"KHR_materials_unlit", "MSFT_texture_dds", "KHR_lights_punctual",
                           "KHR_materials_emissive_strength"}) {
    GltfWriter file = tests::makePlainTerrace();
    file.use(name, true);
    const auto path = folder.write("a.glb", file.toGlb());
    EXPECT_EQ(catchFailure(path),
              path.string() +
                  ": requires glTF extensions that are not supported and change the appearance "
                  "alone: " +
                  name + "; --ignore-appearance loads the file without them");
    const Model model = importModel(path, ignoring);
    expectSameTriangles(readPlainTerrace(), listTriangles(model, model.objects.at(0)), 0);
    EXPECT_EQ(countDiagnostics(model, "ignored_appearance"), 1u) << name;
    EXPECT_EQ(findDiagnosticText(model, "ignored_appearance"), name);
    EXPECT_EQ(countDiagnostics(model, "ignored_extension"), 0u) << name;
  }
  GltfWriter several = tests::makePlainTerrace();
  several.use("KHR_materials_unlit", true);
  several.use("KHR_lights_punctual", true);
  const std::string text = catchFailure(folder.write("several.glb", several.toGlb()));
  EXPECT_NE(text.find(": KHR_lights_punctual, KHR_materials_unlit;"), std::string::npos) << text;
}

TEST(GltfExtensions, RequiredOnesOfTheAppearanceThatAreReadNeedNoOption) {
  const TemporaryFolder folder;
  for (const char* name :
       {"KHR_texture_transform", "EXT_texture_webp", "KHR_materials_pbrSpecularGlossiness",
        "KHR_texture_basisu"}) {  // its textures are reported as missing
    GltfWriter file = tests::makePlainTerrace();
    file.use(name, true);
    EXPECT_TRUE(importModel(folder.write("a.glb", file.toGlb())).diagnostics.empty()) << name;
  }
  GltfWriter optional = tests::makePlainTerrace();
  optional.use("KHR_materials_unlit", false);
  EXPECT_TRUE(importModel(folder.write("b.glb", optional.toGlb())).diagnostics.empty());
}

TEST(GltfExtensions, GltfOneIsRefusedInWords) {
  const TemporaryFolder folder;
  GltfWriter file = tests::makePlainTerrace();
  file.json["asset"]["version"] = "1.0";
  const std::string text = catchFailure(folder.write("old.gltf", file.toGltf("a.bin")));
  EXPECT_NE(text.find("glTF version 1.0 cannot be read; export it as glTF 2.0"), std::string::npos)
      << text;
  // Its nodes and meshes are dictionaries.
  for (const char* section : {"nodes", "meshes"}) {
    GltfWriter old = tests::makePlainTerrace();
    if (std::string_view(section) == "nodes") old.json["asset"]["version"] = "1.0";
    old.json[section] = {{"a", old.json[section][0]}};
    const std::string fault = catchFailure(folder.write("older.gltf", old.toGltf("a.bin")));
    EXPECT_NE(fault.find("glTF version 1.0 cannot be read"), std::string::npos) << fault;
  }
  file.json["asset"] = {{"version", "2.1"}, {"minVersion", "2.1"}};
  const std::string newer = catchFailure(folder.write("newer.glb", file.toGlb()));
  EXPECT_NE(newer.find("needs a reader of glTF 2.1"), std::string::npos) << newer;
}

TEST(GltfSizes, ACountThatTheFileCannotJustifyIsRefused) {
  const TemporaryFolder folder;
  const auto expectRefused = [&](const GltfWriter& file, const std::string& words) {
    const std::string text = catchFailure(folder.write("hostile.glb", file.toGlb()));
    EXPECT_NE(text.find(words), std::string::npos) << text;
  };
  GltfWriter zeros = tests::makeSparseTerrace(false);
  zeros.json["accessors"][0]["count"] = 300'000'000;
  expectRefused(zeros, "more than the file's");
  GltfWriter meshopt = tests::makeMeshoptTerrace({});
  meshopt.json["bufferViews"][0]["extensions"]["EXT_meshopt_compression"]["count"] = 3'000'000'000u;
  expectRefused(meshopt, "more than the file's");
  GltfWriter instances = tests::makeInstancedTerrace(true);
  instances.json["accessors"].push_back(
      {{"componentType", 5126}, {"type", "VEC3"}, {"count", 300'000}});
  instances.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = {
      {"TRANSLATION", 5}};
  expectRefused(instances, "more than the file's");
  // Draco's own header: the varint of the triangle count after method, flags and vertex count.
  GltfWriter draco = tests::makeDracoTerrace(14, true);
  draco.binary.replace(11, 5, "\xff\xff\xff\xff\x0f", 5);
  expectRefused(draco, "Draco header claims 4294967295 triangles");
}

TEST(EncodedGltf, DamagedDracoDataIsReplacedByThePlainDataOfTheFile) {
  const TemporaryFolder folder;
  GltfWriter file = tests::makeDracoTerrace(14, true);
  file.json.erase("extensionsRequired");
  file.binary.replace(0, 5, "OCARD");
  const std::string refused = catchFailure(folder.write("alone.glb", file.toGlb()));
  EXPECT_NE(refused.find("meshes[0].primitives[0]"), std::string::npos) << refused;

  const tests::Terrace terrace;
  Json& primitive = file.json["meshes"][0]["primitives"][0];
  primitive["attributes"]["POSITION"] = file.addPoints(terrace.positions);
  primitive["indices"] = file.addIndices(terrace.indices);
  const Model model = importModel(folder.write("both.glb", file.toGlb()));
  expectSameTriangles(readPlainTerrace(), listTriangles(model, model.objects.at(0)), 0);
  EXPECT_EQ(countDiagnostics(model, "plain_data_used"), 1u);
  EXPECT_NE(findDiagnosticText(model, "plain_data_used").find("meshes[0].primitives[0]"),
            std::string::npos);
  EXPECT_EQ(countDiagnostics(model, "solid_mesh"), 0u);

  // Plain data that is incomplete or damaged does not replace it. Accessors without data are zeros.
  GltfWriter incomplete = file, damaged = file;
  incomplete.json["accessors"][3].erase("bufferView");
  damaged.json["accessors"][3]["count"] = 1u << 20;
  for (const GltfWriter& broken : {incomplete, damaged}) {
    const std::string text = catchFailure(folder.write("broken.glb", broken.toGlb()));
    EXPECT_NE(text.find("its Draco data is damaged"), std::string::npos) << text;
  }
}

// ---- textures -----------------------------------------------------------------------------------

/// The terrace with a texture that only `extension` names.
GltfWriter makeTexturedTerrace(const std::string& extension, const std::string& image,
                               const std::string& mimeType) {
  GltfWriter file = tests::makePlainTerrace();
  const unsigned view = file.addView(image);
  const std::vector<float> uvs(tests::Terrace().positions.size() * 2, 0.25f);
  const unsigned uv = file.addAccessor(static_cast<int>(file.addView(tests::toBytes(uvs))), 5126,
                                       uvs.size() / 2, "VEC2");
  Json& primitive = file.json["meshes"][0]["primitives"][0];
  primitive["attributes"]["TEXCOORD_0"] = uv;
  primitive["material"] = 0;
  file.json["images"] = {{{"bufferView", view}, {"mimeType", mimeType}}};
  file.json["textures"] = {{{"extensions", {{extension, {{"source", 0}}}}}}};
  file.json["materials"] = {
      {{"name", "paint"}, {"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}}};
  file.use(extension);
  return file;
}

std::string makeWebp() {
  const std::vector<std::uint8_t> pixels(8 * 8 * 4, 255);
  std::uint8_t* bytes = nullptr;
  const std::size_t size = WebPEncodeLosslessRGBA(pixels.data(), 8, 8, 32, &bytes);
  std::string image(reinterpret_cast<const char*>(bytes), size);
  WebPFree(bytes);
  return image;
}

TEST(GltfTextures, WebpIsDecoded) {
  const TemporaryFolder folder;
  const GltfWriter file = makeTexturedTerrace("EXT_texture_webp", makeWebp(), "image/webp");
  const Model model = importModel(folder.write("a.glb", file.toGlb()));
  ASSERT_EQ(model.textures.size(), 1u);
  EXPECT_EQ(model.textures[0].width, 8u);
  EXPECT_EQ(model.materials.at(0).baseColourTexture, 0);
  EXPECT_TRUE(model.diagnostics.empty()) << model.diagnostics[0].kind;
  const GltfWriter damaged =
      makeTexturedTerrace("EXT_texture_webp", makeWebp().substr(0, 24), "image/webp");
  const Model without = importModel(folder.write("b.glb", damaged.toGlb()));
  EXPECT_EQ(countDiagnostics(without, "unreadable_texture"), 1u);
}

TEST(GltfTextures, KtxIsReportedAsMissing) {
  const TemporaryFolder folder;
  const GltfWriter file =
      makeTexturedTerrace("KHR_texture_basisu", "\xabKTX 20\xbb\r\n\x1a\n", "image/ktx2");
  const Model model = importModel(folder.write("a.glb", file.toGlb()));
  EXPECT_EQ(model.materials.at(0).baseColourTexture, -1);
  EXPECT_EQ(countDiagnostics(model, "missing_texture"), 1u);
}

TEST(GltfTextures, OnesWithoutAnImageThatIsReadAreReportedAsMissing) {
  const TemporaryFolder folder;
  ImportOptions ignoring;
  ignoring.ignoreAppearance = true;
  const auto expectMissing = [&](const GltfWriter& file, const std::string& words) {
    const Model model = importModel(folder.write("a.glb", file.toGlb()), ignoring);
    EXPECT_EQ(model.materials.at(0).baseColourTexture, -1);
    EXPECT_EQ(countDiagnostics(model, "missing_texture"), 1u);
    EXPECT_NE(findDiagnosticText(model, "missing_texture").find(words), std::string::npos)
        << findDiagnosticText(model, "missing_texture");
  };
  for (const char* extension : {"MSFT_texture_dds", "EXT_texture_foo"})
    expectMissing(makeTexturedTerrace(extension, makeWebp(), "image/webp"), extension);
  GltfWriter file = tests::makePlainTerrace();
  file.json["materials"] = {{{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}}};
  file.json["meshes"][0]["primitives"][0]["material"] = 0;
  expectMissing(file, "materials[0]: its baseColorTexture has no image");
  file.json["textures"] = {{{"sampler", 0}}};
  file.json["samplers"] = Json::array({Json::object()});
  expectMissing(file, "materials[0]: its baseColorTexture has no image");
  file.json["textures"] = {{{"source", 9}}};
  expectMissing(file, "materials[0]: its baseColorTexture has no image");
}

TEST(GltfTextures, OnesWhoseCoordinatesThePrimitiveLacksAreReported) {
  const TemporaryFolder folder;
  const auto readProblem = [&](const GltfWriter& file) {
    return findDiagnosticText(importModel(folder.write("a.glb", file.toGlb())), "missing_texture");
  };
  GltfWriter file = makeTexturedTerrace("EXT_texture_webp", makeWebp(), "image/webp");
  EXPECT_EQ(readProblem(file), "");
  Json& texture = file.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"];
  texture["texCoord"] = 3;
  EXPECT_EQ(readProblem(file), "meshes[0].primitives[0] has no TEXCOORD_3");
  // A file that assimp would read as it is.
  texture["texCoord"] = 0;
  file.json["meshes"][0]["primitives"][0]["attributes"].erase("TEXCOORD_0");
  file.json["textures"] = {{{"source", 0}}};
  file.json["images"][0]["mimeType"] = "image/png";
  for (const char* list : {"extensionsUsed", "extensionsRequired"}) file.json.erase(list);
  EXPECT_EQ(readProblem(file), "meshes[0].primitives[0] has no TEXCOORD_0");
}

TEST(GltfLights, BrokenOnesDoNotRefuseTheFile) {
  constexpr const char* kLights = "KHR_lights_punctual";
  const TemporaryFolder folder;
  const std::vector<std::pair<Json, Json>> cases{
      {{{"light", 0}}, nullptr},                               // none in the file
      {{{"light", 7}}, {{"lights", {{{"type", "point"}}}}}},   // of another index
      {Json::object(), {{"lights", {{{"type", "point"}}}}}},   // no index
      {{{"light", "a"}}, {{"lights", {{{"type", "spot"}}}}}},  // a spot without its cone
      {{{"light", -1}}, {{"lights", Json::object()}}},         // wrong types
      {5, {{"lights", {5}}}}};
  for (const auto& [node, root] : cases) {
    GltfWriter file = tests::makePlainTerrace();
    file.use(kLights, false);
    file.json["nodes"][0]["extensions"][kLights] = node;
    if (!root.is_null()) file.json["extensions"][kLights] = root;
    const Model model = importModel(folder.write("a.glb", file.toGlb()));
    SCOPED_TRACE(node.dump());
    expectSameTriangles(readPlainTerrace(), listTriangles(model, model.objects.at(0)), 0);
    EXPECT_TRUE(model.diagnostics.empty()) << model.diagnostics[0].kind;
  }
}

TEST(GltfVisibility, IsReportedOnlyWhereItHides) {
  constexpr const char* kVisibility = "KHR_node_visibility";
  const TemporaryFolder folder;
  for (const Json& visible : {Json(true), Json(false), Json()}) {
    GltfWriter file = tests::makePlainTerrace();
    file.use(kVisibility, false);
    Json& node = file.json["nodes"][0];
    node["extensions"][kVisibility] = Json::object();
    if (!visible.is_null()) node["extensions"][kVisibility]["visible"] = visible;
    node["extras"]["visible"] = false;
    const Model model = importModel(folder.write("a.glb", file.toGlb()));
    EXPECT_EQ(findDiagnosticText(model, "ignored_extension"), visible == false ? kVisibility : "");
  }
}

TEST(GltfTextures, AnEmissiveOneWithoutAnImageIsReportedAndDoesNotGlow) {
  const TemporaryFolder folder;
  GltfWriter file = tests::makePlainTerrace();
  file.json["textures"] = Json::array({Json::object()});
  file.json["materials"] = {{{"emissiveTexture", {{"index", 0}}}, {"emissiveFactor", {1, 1, 1}}}};
  file.json["meshes"][0]["primitives"][0]["material"] = 0;
  const Model model = importModel(folder.write("a.glb", file.toGlb()));
  EXPECT_EQ(countDiagnostics(model, "missing_texture"), 1u);
  EXPECT_TRUE(model.materials.at(0).emissive.isZero(0));
}

TEST(GltfMaterials, TheDiffuseColourAndTextureOfSpecularGlossinessAreRead) {
  const TemporaryFolder folder;
  GltfWriter file = makeTexturedTerrace("EXT_texture_webp", makeWebp(), "image/webp");
  Json& material = file.json["materials"][0];
  material["extensions"]["KHR_materials_pbrSpecularGlossiness"] = {
      {"diffuseFactor", {0.25, 0.5, 1, 0.75}},
      {"diffuseTexture", {{"index", 0}}},
      {"glossinessFactor", 0.75}};
  const Json metallic = material["pbrMetallicRoughness"];
  material.erase("pbrMetallicRoughness");
  file.use("KHR_materials_pbrSpecularGlossiness");
  const Model model = importModel(folder.write("a.glb", file.toGlb()));
  EXPECT_TRUE(model.diagnostics.empty()) << model.diagnostics[0].kind;
  const Material& read = model.materials.at(0);
  EXPECT_EQ(read.baseColour, Eigen::Vector4f(0.25f, 0.5f, 1, 0.75f));
  EXPECT_EQ(read.baseColourTexture, 0);
  EXPECT_EQ(read.metallic, 0);
  EXPECT_FLOAT_EQ(read.roughness, 0.25f);
  material["pbrMetallicRoughness"] = metallic;
  const Model both = importModel(folder.write("b.glb", file.toGlb()));
  EXPECT_EQ(both.materials.at(0).baseColour, Eigen::Vector4f(1, 1, 1, 1)) << "the core's";
}

TEST(GltfTextures, TheTransformIsAppliedToCoordinates) {
  const TemporaryFolder folder;
  GltfWriter file = makeTexturedTerrace("EXT_texture_webp", makeWebp(), "image/webp");
  file.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["extensions"] = {
      {"KHR_texture_transform", {{"offset", {0.5, 0.25}}, {"scale", {2, -1}}}}};
  const Model model = importModel(folder.write("a.glb", file.toGlb()));
  ASSERT_FALSE(model.meshes.at(0).uvs.empty());
  EXPECT_LT((model.meshes[0].uvs[0] - Eigen::Vector2f(1, 0)).norm(), 1e-6);
}

}  // namespace
}  // namespace enfilade::scene
