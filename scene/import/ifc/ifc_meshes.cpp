#include "scene/import/ifc/ifc_meshes.hpp"

#include <cstring>
#include <type_traits>

namespace enfilade::scene {
namespace {

constexpr double kMaxTransformEntry = 1e15;  // of a transform; beyond it, boxes could overflow

/// Reads values from a message. After the first missing value, all values are zero.
class MessageReader {
 public:
  explicit MessageReader(std::span<const std::byte> bytes) : bytes_(bytes) {}

  template <class T>
  requires std::is_arithmetic_v<T> T read() {
    T value{};
    if (bytes_.size() < sizeof value) {
      complete_ = false;
      bytes_ = {};
      return value;
    }
    std::memcpy(&value, bytes_.data(), sizeof value);
    bytes_ = bytes_.subspan(sizeof value);
    return value;
  }
  std::size_t remaining() const { return bytes_.size(); }
  std::span<const std::byte> rest() const { return bytes_; }
  bool isComplete() const { return complete_; }

 private:
  std::span<const std::byte> bytes_;
  bool complete_ = true;
};

template <class T>
void appendValue(std::vector<std::byte>& to, T value) {
  const auto* bytes = reinterpret_cast<const std::byte*>(&value);
  to.insert(to.end(), bytes, bytes + sizeof value);
}

bool readGeometry(std::span<const std::byte> body, IfcMeshes& meshes) {
  MessageReader in(body);
  const auto id = in.read<std::uint32_t>();
  const auto vertices = in.read<std::uint32_t>();
  const auto indices = in.read<std::uint32_t>();
  const std::uint64_t size = std::uint64_t{vertices} * 24 + std::uint64_t{indices} * 4;
  if (!in.isComplete() || in.remaining() != size || indices % 3 != 0) return false;
  IfcGeometry geometry;
  const std::span<const std::byte> rest = in.rest();  // of the right size, as checked above
  geometry.positions.resize(vertices);
  geometry.normals.resize(vertices);
  for (std::size_t i = 0; i < vertices; ++i) {
    std::memcpy(geometry.positions[i].data(), rest.data() + 24 * i, 12);
    std::memcpy(geometry.normals[i].data(), rest.data() + 24 * i + 12, 12);
  }
  geometry.indices.resize(indices);
  if (indices > 0)
    std::memcpy(geometry.indices.data(), rest.data() + std::size_t{24} * vertices,
                std::size_t{4} * indices);
  for (const std::uint32_t index : geometry.indices)
    if (index >= vertices) return false;
  meshes.geometries[id] = std::move(geometry);
  return true;
}

bool readPlacedGeometry(MessageReader& in, IfcMeshes& meshes,
                        std::vector<IfcPlacedGeometry>& placedGeometries) {
  IfcPlacedGeometry placed;
  placed.geometry = in.read<std::uint32_t>();
  for (int i = 0; i < 4; ++i) {
    const auto channel = in.read<double>();
    placed.colour[i] = static_cast<float>(channel > 0 ? std::min(channel, 1.0) : 0.0);
  }
  for (int column = 0; column < 4; ++column) {
    for (int row = 0; row < 4; ++row)
      placed.worldFromGeometry.matrix()(row, column) = in.read<double>();
  }
  placed.worldFromGeometry.makeAffine();
  if (!in.isComplete() || !meshes.geometries.contains(placed.geometry)) return false;
  const auto& m = placed.worldFromGeometry.matrix();
  if (m.allFinite() && m.cwiseAbs().maxCoeff() <= kMaxTransformEntry)
    placedGeometries.push_back(placed);
  return true;
}

bool readProduct(std::span<const std::byte> body, IfcMeshes& meshes) {
  MessageReader in(body);
  const auto id = in.read<std::uint32_t>();
  const auto count = in.read<std::uint32_t>();
  std::vector<IfcPlacedGeometry> placedGeometries;
  for (std::uint32_t i = 0; i < count; ++i) {
    if (!readPlacedGeometry(in, meshes, placedGeometries)) return false;
  }
  if (!in.isComplete() || in.remaining() != 0) return false;
  std::vector<IfcPlacedGeometry>& known = meshes.products[id];
  known.insert(known.end(), placedGeometries.begin(), placedGeometries.end());
  return true;
}

bool readFailure(std::span<const std::byte> body, IfcMeshes& meshes) {
  MessageReader in(body);
  const auto id = in.read<std::uint32_t>();
  if (!in.isComplete()) return false;
  const auto text = in.rest();
  meshes.failures[id] = {reinterpret_cast<const char*>(text.data()), text.size()};
  return true;
}

}  // namespace

std::size_t IfcMeshes::countTriangles(std::uint32_t product) const {
  const auto found = products.find(product);
  std::size_t count = 0;
  if (found == products.end()) return 0;
  for (const IfcPlacedGeometry& placed : found->second) {
    count += geometries.at(placed.geometry).indices.size() / 3;
  }
  return count;
}

bool readIfcMessage(ImportMessage kind, std::span<const std::byte> body, IfcMeshes& meshes) {
  if (kind == ImportMessage::geometry) return readGeometry(body, meshes);
  if (kind == ImportMessage::product) return readProduct(body, meshes);
  if (kind == ImportMessage::failure) return readFailure(body, meshes);
  return false;
}

void sendGeometry(std::uint32_t id, const IfcGeometry& geometry) {
  std::vector<std::byte> message;
  appendValue(message, id);
  appendValue(message, static_cast<std::uint32_t>(geometry.positions.size()));
  appendValue(message, static_cast<std::uint32_t>(geometry.indices.size()));
  for (std::size_t i = 0; i < geometry.positions.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) appendValue(message, geometry.positions[i][axis]);
    for (int axis = 0; axis < 3; ++axis) appendValue(message, geometry.normals[i][axis]);
  }
  for (const std::uint32_t index : geometry.indices) appendValue(message, index);
  sendMessage(ImportMessage::geometry, message.data(), message.size());
}

void sendProduct(std::uint32_t id, const std::vector<IfcPlacedGeometry>& placedGeometries) {
  std::vector<std::byte> message;
  appendValue(message, id);
  appendValue(message, static_cast<std::uint32_t>(placedGeometries.size()));
  for (const IfcPlacedGeometry& placed : placedGeometries) {
    appendValue(message, placed.geometry);
    for (int i = 0; i < 4; ++i) appendValue(message, static_cast<double>(placed.colour[i]));
    for (int column = 0; column < 4; ++column) {
      for (int row = 0; row < 4; ++row)
        appendValue(message, placed.worldFromGeometry.matrix()(row, column));
    }
  }
  sendMessage(ImportMessage::product, message.data(), message.size());
}

}  // namespace enfilade::scene
