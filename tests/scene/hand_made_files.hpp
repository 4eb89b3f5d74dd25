// Writers of small model files for tests: glTF, GLB.
#pragma once

#include <array>
#include <cstring>
#include <string>
#include <vector>

#include "tests/support/temporary_folder.hpp"

namespace enfilade::tests {

inline constexpr char kOneNode[] = R"({"mesh":0,"name":"box"})";

inline std::string encodeBase64(const std::string& bytes) {
  static constexpr char kDigits[] =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const char c = i + k < bytes.size() ? bytes[i + k] : '\0';
      group = group << 8 | static_cast<unsigned char>(c);
    }
    for (std::size_t k = 0; k < 4; ++k) {
      text += i + k > bytes.size() ? '=' : kDigits[group >> (18 - 6 * k) & 63];
    }
  }
  return text;
}

/// A box of twelve triangles, counter-clockwise seen from outside, from (0, 0, 0) to `size`.
struct BoxMesh {
  std::vector<std::array<float, 3>> positions;
  std::vector<std::uint16_t> indices{0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                                     2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};

  explicit BoxMesh(std::array<float, 3> size, std::array<float, 3> from = {0, 0, 0}) {
    for (unsigned corner = 0; corner < 8; ++corner) {
      positions.push_back({from[0] + ((corner & 1) != 0 ? size[0] : 0),
                           from[1] + ((corner & 2) != 0 ? size[1] : 0),
                           from[2] + ((corner & 4) != 0 ? size[2] : 0)});
    }
  }

  /// Positions, then indices.
  std::string toBytes() const {
    std::string text(positions.size() * 12 + indices.size() * 2, '\0');
    std::memcpy(text.data(), positions.data(), positions.size() * 12);
    std::memcpy(text.data() + positions.size() * 12, indices.data(), indices.size() * 2);
    return text;
  }
};

/// glTF JSON with one mesh 0 of material 0. `scene`: the root nodes, as "0,1"; `nodes`: JSON
/// objects; `material`: its members; `buffer`: the buffer's members except byteLength.
inline std::string makeGltfJson(const BoxMesh& mesh, const std::string& scene,
                                const std::string& nodes, const std::string& material,
                                const std::string& buffer) {
  const std::string count = std::to_string(mesh.positions.size());
  const std::string vertexBytes = std::to_string(mesh.positions.size() * 12);
  const std::string indexCount = std::to_string(mesh.indices.size());
  const std::string indexBytes = std::to_string(mesh.indices.size() * 2);
  return R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[)" + scene +
         R"(]}],"nodes":[)" + nodes + R"(],"materials":[{)" + material +
         R"(}],"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1,"material":0}]}],)" +
         R"("accessors":[{"bufferView":0,"componentType":5126,"count":)" + count +
         R"(,"type":"VEC3","min":[-1e30,-1e30,-1e30],"max":[1e30,1e30,1e30]},)" +
         R"({"bufferView":1,"componentType":5123,"count":)" + indexCount +
         R"(,"type":"SCALAR"}],"bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":)" +
         vertexBytes + R"(},{"buffer":0,"byteOffset":)" + vertexBytes + R"(,"byteLength":)" +
         indexBytes + R"(}],"buffers":[{"byteLength":)" + std::to_string(mesh.toBytes().size()) +
         buffer + "}]}";
}

inline std::string makeGltfFile(const BoxMesh& mesh, const std::string& scene,
                                const std::string& nodes,
                                const std::string& material = R"("name":"paint")") {
  return makeGltfJson(
      mesh, scene, nodes, material,
      R"(,"uri":"data:application/octet-stream;base64,)" + encodeBase64(mesh.toBytes()) + R"(")");
}

/// The same as a GLB file.
inline std::string makeGlbFile(const BoxMesh& mesh, const std::string& scene,
                               const std::string& nodes) {
  const auto word = [](std::size_t value) {
    std::string text(4, '\0');
    for (std::size_t i = 0; i < 4; ++i) text[i] = static_cast<char>(value >> (8 * i) & 255);
    return text;
  };
  std::string json = makeGltfJson(mesh, scene, nodes, R"("name":"paint")", "");
  json.resize((json.size() + 3) / 4 * 4, ' ');
  std::string binary = mesh.toBytes();
  binary.resize((binary.size() + 3) / 4 * 4, '\0');
  return "glTF" + word(2) + word(12 + 8 + json.size() + 8 + binary.size()) + word(json.size()) +
         "JSON" + json + word(binary.size()) + std::string("BIN\0", 4) + binary;
}

}  // namespace enfilade::tests
