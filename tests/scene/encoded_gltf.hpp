// A small terrace in many glTF encodings, for tests: floats, quantized, meshopt, Draco, sparse,
// strips, fans, instances.
#pragma once

#include <draco/compression/encode.h>
#include <draco/mesh/triangle_soup_mesh_builder.h>
#include <meshoptimizer.h>

#include <array>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/scene/hand_made_files.hpp"
#include "tests/scene/meshopt_stream.hpp"

namespace enfilade::tests {

using Json = nlohmann::json;
using Points = std::vector<std::array<float, 3>>;

/// A grid of `side` x `side` quads, each a metre wide, in steps of a quarter metre: not convex, and
/// exact in 16 bits.
struct Terrace {
  static constexpr unsigned side = 7;
  Points positions;
  std::vector<std::uint32_t> indices;

  Terrace() {
    for (unsigned z = 0; z <= side; ++z) {
      for (unsigned x = 0; x <= side; ++x)
        positions.push_back({static_cast<float>(x), 0.25f * static_cast<float>((x * 3 + z * 5) % 7),
                             static_cast<float>(z)});
    }
    for (unsigned z = 0; z < side; ++z) {
      for (unsigned x = 0; x < side; ++x) {
        const std::uint32_t a = computeIndex(x, z), b = computeIndex(x + 1, z),
                            c = computeIndex(x, z + 1), d = computeIndex(x + 1, z + 1);
        for (const std::uint32_t corner : {a, c, b, b, c, d}) indices.push_back(corner);
      }
    }
  }

  static std::uint32_t computeIndex(unsigned x, unsigned z) { return z * (side + 1) + x; }
};

template <class Value>
std::string toBytes(const std::vector<Value>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(Value)};
}

/// A glTF file under construction, with one buffer.
class GltfWriter {
 public:
  GltfWriter() {
    json = {{"asset", {{"version", "2.0"}}}, {"scene", 0}, {"scenes", {{{"nodes", {0u}}}}}};
    for (const char* list : {"accessors", "bufferViews", "meshes", "nodes"})
      json[list] = Json::array();
    json["nodes"].push_back({{"name", "terrace"}, {"mesh", 0}});
  }

  unsigned addView(const std::string& bytes, unsigned stride = 0) {
    binary.resize((binary.size() + 3) / 4 * 4, '\0');
    json["bufferViews"].push_back(
        {{"buffer", 0}, {"byteOffset", binary.size()}, {"byteLength", bytes.size()}});
    if (stride > 0) json["bufferViews"].back()["byteStride"] = stride;
    binary += bytes;
    return static_cast<unsigned>(json["bufferViews"].size() - 1);
  }
  /// `view` below zero: none.
  unsigned addAccessor(int view, int componentType, std::size_t count, const char* type,
                       bool normalised = false) {
    json["accessors"].push_back(
        {{"componentType", componentType}, {"count", count}, {"type", type}});
    if (view >= 0) json["accessors"].back()["bufferView"] = view;
    if (normalised) json["accessors"].back()["normalized"] = true;
    return static_cast<unsigned>(json["accessors"].size() - 1);
  }
  unsigned addPoints(const Points& points) {
    return addAccessor(static_cast<int>(addView(toBytes(points))), 5126, points.size(), "VEC3");
  }
  unsigned addIndices(const std::vector<std::uint32_t>& indices) {
    return addAccessor(static_cast<int>(addView(toBytes(indices))), 5125, indices.size(), "SCALAR");
  }
  /// Adds the mesh of the file, or another primitive of it.
  Json& addPrimitive(unsigned positions, int indices, unsigned mode = 4) {
    if (json["meshes"].empty()) json["meshes"].push_back({{"primitives", Json::array()}});
    Json& primitives = json["meshes"][0]["primitives"];
    primitives.push_back({{"attributes", {{"POSITION", positions}}}, {"mode", mode}});
    if (indices >= 0) primitives.back()["indices"] = indices;
    return primitives.back();
  }
  void use(const std::string& extension, bool required = true) {
    json["extensionsUsed"].push_back(extension);
    if (required) json["extensionsRequired"].push_back(extension);
  }

  /// Replaces a buffer view's data by a compressed form. With `fallback` the plain data stays.
  void compressView(unsigned view, const std::string& extension, const std::string& packed,
                    const char* mode, unsigned stride, std::size_t count, const char* filter,
                    bool fallback) {
    const std::size_t packedView = addView(packed);
    const Json place = json["bufferViews"][packedView];
    json["bufferViews"].erase(packedView);
    Json& target = json["bufferViews"][view];
    target["extensions"][extension] = {{"buffer", 0},
                                       {"byteOffset", place["byteOffset"]},
                                       {"byteLength", packed.size()},
                                       {"byteStride", stride},
                                       {"count", count},
                                       {"mode", mode},
                                       {"filter", filter}};
    if (fallback) return;
    target["buffer"] = 1;
    target["byteOffset"] = 0;
    target["byteLength"] = stride * count;
    needsPlaceholder = true;
  }

  std::string toGlb() const {
    const auto word = [](std::size_t value) {
      const auto number = static_cast<std::uint32_t>(value);
      return std::string(reinterpret_cast<const char*>(&number), 4);
    };
    std::string text = makeJson(Json{{"byteLength", binary.size()}}).dump(), bytes = binary;
    text.resize((text.size() + 3) / 4 * 4, ' ');
    bytes.resize((bytes.size() + 3) / 4 * 4, '\0');
    return "glTF" + word(2) + word(28 + text.size() + bytes.size()) + word(text.size()) + "JSON" +
           text + word(bytes.size()) + std::string("BIN\0", 4) + bytes;
  }
  std::string toGltf(const std::string& uri) const {
    return makeJson(Json{{"byteLength", binary.size()}, {"uri", uri}}).dump();
  }

  Json json;
  std::string binary;
  bool needsPlaceholder = false;

 private:
  Json makeJson(const Json& buffer) const {
    Json whole = json;
    whole["buffers"] = Json::array({buffer});
    if (needsPlaceholder)
      whole["buffers"].push_back(
          {{"byteLength", 1 << 20},
           {"extensions", {{"EXT_meshopt_compression", {{"fallback", true}}}}}});
    return whole;
  }
};

inline std::string packVertices(const std::string& bytes, std::size_t stride) {
  const std::size_t count = bytes.size() / stride;
  std::vector<unsigned char> packed(meshopt_encodeVertexBufferBound(count, stride));
  packed.resize(
      meshopt_encodeVertexBuffer(packed.data(), packed.size(), bytes.data(), count, stride));
  return toBytes(packed);
}

inline std::string packTriangles(const std::vector<std::uint32_t>& indices, std::size_t vertices) {
  std::vector<unsigned char> packed(meshopt_encodeIndexBufferBound(indices.size(), vertices));
  packed.resize(
      meshopt_encodeIndexBuffer(packed.data(), packed.size(), indices.data(), indices.size()));
  return toBytes(packed);
}

inline std::string packSequence(const std::vector<std::uint32_t>& indices, std::size_t vertices) {
  std::vector<unsigned char> packed(meshopt_encodeIndexSequenceBound(indices.size(), vertices));
  packed.resize(
      meshopt_encodeIndexSequence(packed.data(), packed.size(), indices.data(), indices.size()));
  return toBytes(packed);
}

/// Draco data whose attribute 0 is the positions, of `bits` bits each.
inline std::string packDraco(const Points& positions, const std::vector<std::uint32_t>& indices,
                             int bits, bool sequential) {
  draco::TriangleSoupMeshBuilder builder;
  builder.Start(static_cast<int>(indices.size() / 3));
  const int id = builder.AddAttribute(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32);
  for (unsigned face = 0; face < indices.size() / 3; ++face)
    builder.SetAttributeValuesForFace(
        id, draco::FaceIndex(face), positions[indices[3 * face]].data(),
        positions[indices[3 * face + 1]].data(), positions[indices[3 * face + 2]].data());
  const auto mesh = builder.Finalize();
  draco::Encoder encoder;
  encoder.SetAttributeQuantization(draco::GeometryAttribute::POSITION, bits);
  encoder.SetEncodingMethod(sequential ? draco::MESH_SEQUENTIAL_ENCODING
                                       : draco::MESH_EDGEBREAKER_ENCODING);
  draco::EncoderBuffer buffer;
  if (!encoder.EncodeMeshToBuffer(*mesh, &buffer).ok()) return "";
  return {buffer.data(), buffer.size()};
}

// ---- the terrace, encoded
// ------------------------------------------------------------------------

inline GltfWriter makePlainTerrace() {
  const Terrace terrace;
  GltfWriter file;
  const unsigned positions = file.addPoints(terrace.positions);
  file.addPrimitive(positions, static_cast<int>(file.addIndices(terrace.indices)));
  return file;
}

/// Positions of 16 bits, whose step of a quarter metre the node scales.
inline GltfWriter makeQuantizedTerrace(bool normalised) {
  const Terrace terrace;
  std::vector<std::int16_t> steps;
  for (const auto& p : terrace.positions) {
    for (const float v : p) steps.push_back(static_cast<std::int16_t>(std::lround(v * 4)));
    steps.push_back(0);  // vertices are aligned to four bytes
  }
  GltfWriter file;
  const unsigned view = file.addView(toBytes(steps), 8);
  const unsigned positions =
      file.addAccessor(static_cast<int>(view), 5122, terrace.positions.size(), "VEC3", normalised);
  file.addPrimitive(positions, static_cast<int>(file.addIndices(terrace.indices)));
  const double scale = normalised ? 32767 * 0.25 : 0.25;
  file.json["nodes"][0]["scale"] = {scale, scale, scale};
  file.use("KHR_mesh_quantization");
  return file;
}

struct MeshoptOptions {
  const char* extension = "EXT_meshopt_compression";
  bool fallback = false, sequence = false, exponential = false;
  unsigned version = 0;  ///< of the vertex codec
};

inline GltfWriter makeMeshoptTerrace(const MeshoptOptions& options) {
  const Terrace terrace;
  const std::size_t count = terrace.positions.size();
  GltfWriter file = makePlainTerrace();
  std::string vertices = toBytes(terrace.positions);
  if (options.exponential)
    meshopt_encodeFilterExp(vertices.data(), count, 12, 20, terrace.positions[0].data());
  file.json["bufferViews"][0]["byteStride"] = 12;
  const std::string packed =
      options.version == 0 ? packVertices(vertices, 12) : packVerticesOfVersion1(vertices, 12);
  file.compressView(0, options.extension, packed, "ATTRIBUTES", 12, count,
                    options.exponential ? "EXPONENTIAL" : "NONE", options.fallback);
  const std::string indices = options.sequence ? packSequence(terrace.indices, count)
                                               : packTriangles(terrace.indices, count);
  file.compressView(1, options.extension, indices, options.sequence ? "INDICES" : "TRIANGLES", 4,
                    terrace.indices.size(), "NONE", options.fallback);
  file.use(options.extension, !options.fallback);
  return file;
}

inline GltfWriter makeDracoTerrace(int bits, bool sequential) {
  const Terrace terrace;
  GltfWriter file;
  const unsigned view =
      file.addView(packDraco(terrace.positions, terrace.indices, bits, sequential));
  const unsigned positions = file.addAccessor(-1, 5126, terrace.positions.size(), "VEC3");
  const unsigned indices = file.addAccessor(-1, 5125, terrace.indices.size(), "SCALAR");
  file.addPrimitive(positions, static_cast<int>(indices))["extensions"] = {
      {"KHR_draco_mesh_compression", {{"bufferView", view}, {"attributes", {{"POSITION", 0}}}}}};
  file.use("KHR_draco_mesh_compression");
  return file;
}

/// Every other position is sparse; without a base, all of them, upon zeros.
inline GltfWriter makeSparseTerrace(bool base) {
  const Terrace terrace;
  Points dense = terrace.positions, values;
  std::vector<std::uint16_t> places;
  for (std::uint16_t i = 0; i < dense.size(); ++i) {
    if (base && i % 2 == 0) continue;
    places.push_back(i);
    values.push_back(dense[i]);
    dense[i] = {99, 99, 99};
  }
  GltfWriter file;
  const unsigned positions =
      base ? file.addPoints(dense) : file.addAccessor(-1, 5126, dense.size(), "VEC3");
  const unsigned placeView = file.addView(toBytes(places)),
                 valueView = file.addView(toBytes(values));
  file.json["accessors"][positions]["sparse"] = {
      {"count", places.size()},
      {"indices", {{"bufferView", placeView}, {"componentType", 5123}}},
      {"values", {{"bufferView", valueView}}}};
  file.addPrimitive(positions, static_cast<int>(file.addIndices(terrace.indices)));
  return file;
}

/// One strip, whose rows repeated corners join.
inline GltfWriter makeStripTerrace() {
  const Terrace terrace;
  std::vector<std::uint32_t> strip;
  for (unsigned z = 0; z < Terrace::side; ++z) {
    if (z > 0) strip.insert(strip.end(), {strip.back(), Terrace::computeIndex(0, z)});
    for (unsigned x = 0; x <= Terrace::side; ++x)
      strip.insert(strip.end(), {Terrace::computeIndex(x, z), Terrace::computeIndex(x, z + 1)});
  }
  GltfWriter file;
  const unsigned positions = file.addPoints(terrace.positions);
  file.addPrimitive(positions, static_cast<int>(file.addIndices(strip)), 5);
  return file;
}

/// A fan of two triangles for each quad.
inline GltfWriter makeFanTerrace() {
  const Terrace terrace;
  GltfWriter file;
  const unsigned positions = file.addPoints(terrace.positions);
  for (unsigned z = 0; z < Terrace::side; ++z) {
    for (unsigned x = 0; x < Terrace::side; ++x)
      file.addPrimitive(
          positions,
          static_cast<int>(file.addIndices(
              {Terrace::computeIndex(x + 1, z), Terrace::computeIndex(x, z),
               Terrace::computeIndex(x, z + 1), Terrace::computeIndex(x + 1, z + 1)})),
          6);
  }
  return file;
}

/// The terrace three times, turned and scaled, as instances of one node.
inline GltfWriter makeInstancedTerrace(bool required) {
  GltfWriter file = makePlainTerrace();
  const unsigned moves = file.addPoints({{0, 0, 0}, {20, 1, 0}, {40, 2, 0}});
  const unsigned scales = file.addPoints({{1, 1, 1}, {2, 2, 2}, {1, 3, 1}});
  // A quarter turn about Y for the second, normalised integers.
  const unsigned view = file.addView(
      toBytes(std::vector<std::int16_t>{0, 0, 0, 32767, 0, 23170, 0, 23170, 0, 0, 0, 32767}));
  const unsigned turns = file.addAccessor(static_cast<int>(view), 5122, 3, "VEC4", true);
  file.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = {
      {"TRANSLATION", moves}, {"SCALE", scales}, {"ROTATION", turns}, {"_ID", moves}};
  file.use("EXT_mesh_gpu_instancing", required);
  return file;
}

/// Skinned to two joints, without inverse bind matrices, and with a morph target that
/// doubles it.
inline GltfWriter makePosedTerrace() {
  GltfWriter file = makePlainTerrace();
  const std::size_t vertices = Terrace().positions.size();
  std::vector<std::uint8_t> joints, weights;
  for (std::size_t v = 0; v < vertices; ++v) {
    joints.insert(joints.end(), {0, 1, 0, 0});
    weights.insert(weights.end(), {64, 191, 0, 0});  // of 255
  }
  Json& primitive = file.json["meshes"][0]["primitives"][0];
  const int jointView = static_cast<int>(file.addView(toBytes(joints)));
  const int weightView = static_cast<int>(file.addView(toBytes(weights)));
  primitive["attributes"]["JOINTS_0"] = file.addAccessor(jointView, 5121, vertices, "VEC4");
  primitive["attributes"]["WEIGHTS_0"] = file.addAccessor(weightView, 5121, vertices, "VEC4", true);
  primitive["targets"] = {{{"POSITION", primitive["attributes"]["POSITION"]}}};
  file.json["meshes"][0]["weights"] = {1};
  file.json["nodes"][0]["skin"] = 0;
  file.json["nodes"].push_back({{"translation", {0, 1, 0}}, {"children", {2}}});
  file.json["nodes"].push_back({{"rotation", {0, 0, 0.6, 0.8}}});
  file.json["scenes"][0]["nodes"].push_back(1);
  file.json["skins"] = Json::array({{{"joints", {1, 2}}}});
  return file;
}

}  // namespace enfilade::tests
