// Reads binary glTF files of the server in tests.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cstdint>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace enfilade::server::testing {

class GlbReader {
 public:
  /// Fails the test if the chunks do not make up the file.
  template <class Bytes>
  explicit GlbReader(const Bytes& bytes) : text_(bytes.begin(), bytes.end()) {
    const std::size_t jsonBytes = readWord(12);
    EXPECT_EQ(text_.substr(0, 4), "glTF");
    EXPECT_EQ(readWord(4), 2u);
    EXPECT_EQ(readWord(8), text_.size());
    EXPECT_EQ(text_.substr(16, 4), "JSON");
    json = nlohmann::json::parse(text_.substr(20, jsonBytes));
    binaryStart_ = 20 + jsonBytes + 8;
    EXPECT_EQ(text_.size(), binaryStart_ + readWord(20 + jsonBytes));
    EXPECT_EQ(jsonBytes % 4, 0u);
  }

  /// The numbers of an accessor as they are stored.
  template <class Number>
  std::vector<Number> readNumbers(std::size_t accessor) const {
    static const std::map<std::string, std::size_t> kComponents{
        {"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}};
    const auto& one = json.at("accessors").at(accessor);
    const auto& view = json.at("bufferViews").at(one.at("bufferView").get<std::size_t>());
    std::vector<Number> read(one.at("count").get<std::size_t>() * kComponents.at(one.at("type")));
    EXPECT_EQ(view.at("byteLength"), read.size() * sizeof(Number));
    std::memcpy(read.data(), text_.data() + binaryStart_ + view.at("byteOffset").get<std::size_t>(),
                read.size() * sizeof(Number));
    return read;
  }
  std::vector<std::uint32_t> readIndices(std::size_t accessor) const {
    if (json.at("accessors").at(accessor).at("componentType") == 5125)
      return readNumbers<std::uint32_t>(accessor);
    const auto narrow = readNumbers<std::uint16_t>(accessor);
    return {narrow.begin(), narrow.end()};
  }
  std::string readView(std::size_t index) const {
    const auto& one = json.at("bufferViews").at(index);
    return text_.substr(binaryStart_ + one.at("byteOffset").get<std::size_t>(),
                        one.at("byteLength").get<std::size_t>());
  }

  /// A triangle as a viewer draws it.
  struct Triangle {
    std::uint32_t entity = 0;
    Eigen::Vector3d corners[3];
  };
  /// All triangles in the scene's frame, instances included.
  std::vector<Triangle> collectDrawnTriangles() const {
    std::vector<Triangle> drawn;
    if (!json.at("scenes").at(0).contains("nodes")) return drawn;
    for (const std::size_t node : json.at("scenes").at(0).at("nodes"))
      visit(node, Eigen::Affine3d::Identity(), drawn);
    return drawn;
  }

  /// The transforms of an instanced node, by entity.
  std::map<std::uint32_t, Eigen::Affine3d> readInstances(const nlohmann::json& node) const {
    const auto& attributes = node.at("extensions").at("EXT_mesh_gpu_instancing").at("attributes");
    const auto t = readNumbers<float>(attributes.at("TRANSLATION"));
    const auto r = readNumbers<float>(attributes.at("ROTATION"));
    const auto s = readNumbers<float>(attributes.at("SCALE"));
    const auto ids = readNumbers<float>(attributes.at("_ENTITY_ID"));
    std::map<std::uint32_t, Eigen::Affine3d> found;
    for (std::size_t i = 0; i < ids.size(); ++i) {
      const Eigen::Quaterniond q(r[4 * i + 3], r[4 * i], r[4 * i + 1], r[4 * i + 2]);
      found[static_cast<std::uint32_t>(ids[i])] =
          Eigen::Translation3d(t[3 * i], t[3 * i + 1], t[3 * i + 2]) * q *
          Eigen::Scaling(Eigen::Vector3d(s[3 * i], s[3 * i + 1], s[3 * i + 2]));
    }
    return found;
  }

  nlohmann::json json;

 private:
  std::size_t readWord(std::size_t at) const {
    std::uint32_t value = 0;
    std::memcpy(&value, text_.data() + at, sizeof value);
    return value;
  }

  static Eigen::Affine3d readLocalTransform(const nlohmann::json& node) {
    const auto t = node.value("translation", std::vector<double>{0, 0, 0});
    const auto r = node.value("rotation", std::vector<double>{0, 0, 0, 1});
    const auto s = node.value("scale", std::vector<double>{1, 1, 1});
    return Eigen::Translation3d(t[0], t[1], t[2]) * Eigen::Quaterniond(r[3], r[0], r[1], r[2]) *
           Eigen::Scaling(Eigen::Vector3d(s[0], s[1], s[2]));
  }

  void visit(std::size_t index, const Eigen::Affine3d& parent, std::vector<Triangle>& into) const {
    const auto& node = json.at("nodes").at(index);
    const Eigen::Affine3d transform = parent * readLocalTransform(node);
    if (node.contains("children"))
      for (const std::size_t child : node.at("children")) visit(child, transform, into);
    if (!node.contains("mesh")) return;
    for (const auto& primitive :
         json.at("meshes").at(node.at("mesh").get<std::size_t>()).at("primitives")) {
      if (node.contains("extensions")) {
        for (const auto& [entity, instance] : readInstances(node))
          append(primitive, transform * instance, entity, into);
      } else {
        append(primitive, transform, node.at("extras").value("entity", 0u), into);
      }
    }
  }

  void append(const nlohmann::json& primitive, const Eigen::Affine3d& transform,
              std::uint32_t entity, std::vector<Triangle>& into) const {
    const auto& attributes = primitive.at("attributes");
    const auto positions = readNumbers<float>(attributes.at("POSITION"));
    std::vector<float> ids;
    if (attributes.contains("_ENTITY_ID")) ids = readNumbers<float>(attributes.at("_ENTITY_ID"));
    const auto corners = readIndices(primitive.at("indices"));
    for (std::size_t i = 0; i + 2 < corners.size(); i += 3) {
      Triangle& triangle = into.emplace_back();
      triangle.entity = ids.empty() ? entity : static_cast<std::uint32_t>(ids.at(corners[i]));
      for (std::size_t c = 0; c < 3; ++c) {
        const std::size_t at = 3 * std::size_t{corners[i + c]};
        triangle.corners[c] =
            transform * Eigen::Vector3d(positions.at(at), positions[at + 1], positions[at + 2]);
      }
    }
  }

  std::string text_;
  std::size_t binaryStart_ = 0;
};

}  // namespace enfilade::server::testing
