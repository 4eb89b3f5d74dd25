// Vertex colours of glTF (linear, in all encodings), OBJ and PLY (sRGB) become sRGB with linear
// alpha.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>

#include "scene/import/cache/deduplicate_meshes.hpp"
#include "scene/import/gltf/encoding/meshopt_view.hpp"
#include "tests/scene/encoded_gltf.hpp"
#include "tests/scene/import_outcome.hpp"

namespace enfilade::scene {
namespace {

using tests::GltfWriter;
using tests::TemporaryFolder;
using Json = tests::Json;

/// A triangle whose corners are red, half green (linear) and blue of alpha 0.2.
constexpr std::array<std::array<double, 4>, 3> kLinear{
    {{1, 0, 0, 1}, {0, 0.5, 0, 1}, {0, 0, 1, 0.2}}};

/// As wanted from a file with alpha, and from one without. 0.5 is 188 in sRGB (IEC 61966-2-1).
std::vector<VertexColour> listWantedColours(bool alpha) {
  return {{255, 0, 0, 255},
          {0, 188, 0, 255},
          {0, 0, 255, alpha ? std::uint8_t{51} : std::uint8_t{255}}};
}

GltfWriter makePlainTriangle() {
  GltfWriter file;
  file.addPrimitive(file.addPoints({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}), -1);
  return file;
}

/// The colours in a type of component; integers are padded to four bytes a vertex as glTF demands.
template <class Component>
unsigned addColours(GltfWriter& file, int componentType, std::size_t channels, double full) {
  const std::size_t stride = (channels * sizeof(Component) + 3) / 4 * 4;
  std::string bytes(3 * stride, '\0');
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t c = 0; c < channels; ++c) {
      const double scaled = kLinear[i][c] * full;
      const auto value = static_cast<Component>(full > 1 ? scaled + 0.5 : scaled);
      std::memcpy(bytes.data() + i * stride + c * sizeof(Component), &value, sizeof value);
    }
  }
  const auto view = static_cast<int>(file.addView(bytes, static_cast<unsigned>(stride)));
  return file.addAccessor(view, componentType, 3, channels == 3 ? "VEC3" : "VEC4", full > 1);
}

std::vector<VertexColour> readColours(const GltfWriter& file) {
  const TemporaryFolder folder;
  const Model model = importModel(folder.write("a.glb", file.toGlb()));
  EXPECT_EQ(countDiagnostics(model, "vertex_colours_ignored"), 0u);
  return model.meshes.at(0).colours;
}

void expectNear(const std::vector<VertexColour>& read, const std::vector<VertexColour>& wanted) {
  ASSERT_EQ(read.size(), wanted.size());
  for (std::size_t i = 0; i < read.size(); ++i)
    for (std::size_t c = 0; c < 4; ++c) EXPECT_NEAR(read[i][c], wanted[i][c], 1) << i << ' ' << c;
}

TEST(VertexColours, OfGltfAreLinearInAllEncodings) {
  for (const std::size_t channels : {std::size_t{3}, std::size_t{4}}) {
    SCOPED_TRACE(channels);
    for (int encoding = 0; encoding < 3; ++encoding) {
      SCOPED_TRACE(encoding);
      GltfWriter file = makePlainTriangle();
      Json& attributes = file.json["meshes"][0]["primitives"][0]["attributes"];
      attributes["COLOR_0"] = encoding == 0 ? addColours<std::uint8_t>(file, 5121, channels, 255)
                              : encoding == 1
                                  ? addColours<std::uint16_t>(file, 5123, channels, 65535)
                                  : addColours<float>(file, 5126, channels, 1);
      expectNear(readColours(file), listWantedColours(channels == 4));
    }
  }
}

/// A colour of K bits a channel as the filter "COLOR" takes it. Green, red and alpha lose at most
/// their last bit.
template <class Channel>
std::array<Channel, 4> encodeColour(const std::array<int, 4>& rgba, int bits) {
  const auto [r, g, b, a] = rgba;
  const int co = (r - b) >> 1, middle = b + co, cg = (g - middle) >> 1;
  return {static_cast<Channel>(middle + cg), static_cast<Channel>(co), static_cast<Channel>(cg),
          static_cast<Channel>(1 << (bits - 1) | a >> 1)};
}

template <class Channel>
void expectColoursDecoded(int bits) {
  SCOPED_TRACE(bits);
  constexpr int kFull = std::numeric_limits<Channel>::max();
  const int full = (1 << bits) - 1;
  std::vector<std::array<int, 4>> colours;
  for (int i = 0; i < 81; ++i)  // the corners, edges and faces of the colour space, and alpha
    colours.push_back(
        {i % 3 * full / 2, i / 3 % 3 * full / 2, i / 9 % 3 * full / 2, i / 27 * full / 2});
  std::vector<std::array<Channel, 4>> encoded;
  for (const auto& colour : colours) encoded.push_back(encodeColour<Channel>(colour, bits));
  const std::size_t stride = 4 * sizeof(Channel);
  std::string bytes;
  const std::string packed = tests::packVertices(tests::toBytes(encoded), stride);
  ASSERT_EQ(decodeMeshoptView({colours.size(), stride, "ATTRIBUTES", "COLOR", packed}, bytes), "");
  ASSERT_EQ(bytes.size(), colours.size() * stride);
  std::vector<std::array<Channel, 4>> decoded(colours.size());
  std::memcpy(decoded.data(), bytes.data(), bytes.size());
  for (std::size_t i = 0; i < colours.size(); ++i)
    for (std::size_t c = 0; c < 4; ++c)
      EXPECT_LE(std::abs(decoded[i][c] - static_cast<double>(kFull) * colours[i][c] / full),
                static_cast<double>(kFull) / full + 0.5)
          << i << ' ' << c;
}

TEST(VertexColours, OfMeshoptsFilterAreDecodedWithinAStepOfTheirBits) {
  for (const int bits : {4, 6, 8}) expectColoursDecoded<std::uint8_t>(bits);
  for (const int bits : {8, 11, 16}) expectColoursDecoded<std::uint16_t>(bits);
  // A colour whose bits are all known: half of 6 bits, 32 of 63, is 129.5 of 255.
  std::string bytes;
  const std::string grey = tests::packVertices(std::string("\x20\0\0\x3f", 4), 4);
  ASSERT_EQ(decodeMeshoptView({1, 4, "ATTRIBUTES", "COLOR", grey}, bytes), "");
  EXPECT_EQ(bytes, "\x82\x82\x82\xff");
  const std::string without = tests::packVertices(std::string("\x20\0\0\1", 4), 4);
  EXPECT_EQ(decodeMeshoptView({1, 4, "ATTRIBUTES", "COLOR", without}, bytes),
            "its compressed colours are damaged");
  EXPECT_EQ(decodeMeshoptView({1, 12, "ATTRIBUTES", "COLOR", without}, bytes),
            "colours of neither 4 nor 8 bytes");
}

TEST(VertexColours, OfMeshoptsFilterAreDrawn) {
  for (const char* extension : {"EXT_meshopt_compression", "KHR_meshopt_compression"}) {
    GltfWriter file = makePlainTriangle();
    std::vector<std::array<std::uint8_t, 4>> encoded;
    for (const auto& colour : kLinear) {
      std::array<int, 4> bytes{};
      for (std::size_t c = 0; c < 4; ++c) bytes[c] = static_cast<int>(colour[c] * 255 + 0.5);
      encoded.push_back(encodeColour<std::uint8_t>(bytes, 8));
    }
    const unsigned view = file.addView(tests::toBytes(encoded), 4);
    file.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] =
        file.addAccessor(static_cast<int>(view), 5121, 3, "VEC4", true);
    file.compressView(view, extension, tests::packVertices(tests::toBytes(encoded), 4),
                      "ATTRIBUTES", 4, 3, "COLOR", false);
    file.use(extension);
    const std::vector<VertexColour> read = readColours(file), wanted = listWantedColours(true);
    ASSERT_EQ(read.size(), wanted.size());
    // A step of linear 8 bits near black is 13 of sRGB.
    for (std::size_t i = 0; i < read.size(); ++i)
      for (std::size_t c = 0; c < 4; ++c)
        EXPECT_NEAR(read[i][c], wanted[i][c], 13) << i << ' ' << c;
  }
}

TEST(VertexColours, OfGltfSurviveARewriteForAnotherReason) {
  GltfWriter file = makePlainTriangle();
  file.json["meshes"][0]["primitives"][0]["mode"] = 5;  // a strip
  file.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] =
      addColours<float>(file, 5126, 4, 1);
  expectNear(readColours(file), listWantedColours(true));
}

TEST(VertexColours, ThatAreNotOnePerVertexAreReported) {
  const TemporaryFolder folder;
  GltfWriter file = makePlainTriangle();
  Json& attributes = file.json["meshes"][0]["primitives"][0]["attributes"];
  attributes["COLOR_0"] = file.addPoints({{1, 0, 0}, {1, 0, 0}});
  Model model = importModel(folder.write("short.glb", file.toGlb()));
  EXPECT_TRUE(model.meshes.at(0).colours.empty());
  EXPECT_EQ(findDiagnosticText(model, "vertex_colours_ignored"),
            "meshes[0].primitives[0]: not one per vertex");
  attributes["COLOR_0"] = attributes["POSITION"];
  file.json["accessors"][0]["type"] = "VEC3";
  file.json["accessors"].push_back(file.json["accessors"][0]);
  file.json["accessors"].back()["componentType"] = 5120;
  attributes["COLOR_0"] = file.json["accessors"].size() - 1;
  model = importModel(folder.write("signed.glb", file.toGlb()));
  EXPECT_EQ(findDiagnosticText(model, "vertex_colours_ignored"),
            "meshes[0].primitives[0]: of a type that glTF does not allow");
}

TEST(VertexColours, ThatCannotBeReadLeaveTheMeshAsItIs) {
  const TemporaryFolder folder;
  GltfWriter file = makePlainTriangle();
  const unsigned colours = addColours<std::uint8_t>(file, 5121, 4, 255);
  file.json["accessors"][colours]["byteOffset"] = 1 << 20;
  file.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = colours;
  const Model model = importModel(folder.write("a.glb", file.toGlb()));
  EXPECT_EQ(model.meshes.at(0).triangleCount(), 1u);
  EXPECT_TRUE(model.meshes[0].colours.empty());
  EXPECT_EQ(countDiagnostics(model, "vertex_colours_ignored"), 1u);
  EXPECT_EQ(countDiagnostics(model, "solid_mesh"), 0u);
}

TEST(VertexColours, ThatAreAllWhiteTakeNoMemory) {
  GltfWriter file = makePlainTriangle();
  file.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] =
      file.addPoints({{1, 1, 1}, {1, 1, 1}, {1, 1, 1}});
  EXPECT_TRUE(readColours(file).empty());
}

TEST(VertexColours, OfObjAreSrgbAndMultiplyWhite) {
  const TemporaryFolder folder;
  const std::vector<VertexColour> wanted{{255, 0, 0, 255}, {0, 128, 0, 255}, {0, 0, 255, 255}};
  for (const char* text : {"v 0 0 0 1 0 0\nv 1 0 0 0 0.50196 0\nv 0 1 0 0 0 1\nf 1 2 3\n",
                           "v 0 0 0 255 0 0\nv 1 0 0 0 128 0\nv 0 1 0 0 0 255\nf 1 2 3\n"}) {
    const Model model = importModel(folder.write("a.obj", text));
    expectNear(model.meshes.at(0).colours, wanted);
    EXPECT_EQ(model.materials.at(model.meshes[0].material).baseColour, Eigen::Vector4f(1, 1, 1, 1));
  }
}

TEST(VertexColours, OnlyVerticesOfEqualColourAreJoined) {
  const TemporaryFolder folder;
  // Two triangles with a common edge; at one of its ends their colours differ.
  const Model model = importModel(
      folder.write("a.obj",
                   "v 0 0 0 1 0 0\nv 1 0 0 1 0 0\nv 0 1 0 1 0 0\nv 1 0 0 1 0 0\nv 1 1 0 0 1 0\n"
                   "v 0 1 0 0 1 0\nf 1 2 3\nf 4 5 6\n"));
  EXPECT_EQ(model.meshes.at(0).positions.size(), 5u);
  EXPECT_EQ(model.meshes[0].triangleCount(), 2u);
}

TEST(VertexColours, OfPlyAreSrgbInAllTypes) {
  const TemporaryFolder folder;
  const std::vector<VertexColour> wanted{{255, 0, 0, 255}, {0, 128, 0, 255}, {0, 0, 255, 255}};
  const auto make = [](const std::string& type, const std::string& full, const std::string& half) {
    std::string text = "ply\nformat ascii 1.0\nelement vertex 3\n";
    for (const char* axis : {"x", "y", "z"}) text += std::string("property float ") + axis + "\n";
    for (const char* name : {"red", "green", "blue", "alpha"})
      text += "property " + type + " " + name + "\n";
    return text + "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0 " +
           full + " 0 0 0\n1 0 0 0 " + half + " 0 0\n0 1 0 0 0 " + full + " 0\n3 0 1 2\n";
  };
  for (const std::string& text : {make("uchar", "255", "128"), make("ushort", "65535", "32896"),
                                  make("float", "1", "0.50196")}) {
    const Model model = importModel(folder.write("a.ply", text));
    expectNear(model.meshes.at(0).colours, wanted);
    EXPECT_EQ(model.materials.at(0).baseColour, Eigen::Vector4f(1, 1, 1, 1));
  }
}

TEST(VertexColours, KeepMeshesApartThatAreEqualOtherwise) {
  Model model;
  model.materials.resize(1);
  Mesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.indices = {0, 1, 2};
  model.meshes.assign(3, mesh);
  model.meshes[1].colours.assign(3, {255, 0, 0, 255});
  model.meshes[2].colours.assign(3, {255, 0, 0, 255});
  model.objects.resize(3);
  for (std::uint32_t i = 0; i < 3; ++i) model.objects[i].meshes = {i};
  EXPECT_EQ(deduplicateMeshes(model), 1u);
  EXPECT_NE(model.objects[0].meshes, model.objects[1].meshes);
  EXPECT_EQ(model.objects[1].meshes, model.objects[2].meshes);
}

}  // namespace
}  // namespace enfilade::scene
