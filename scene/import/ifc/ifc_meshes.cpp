#include "scene/import/ifc/ifc_meshes.hpp"

#include <cmath>
#include <cstring>
#include <type_traits>

namespace enfilade::scene {
namespace {

constexpr double kGreatestEntry = 1e15;  // of a transform; beyond it boxes could overflow

/// Takes values off the front of a frame; once one is missing, all that follow are zero.
class FrameReader {
 public:
  explicit FrameReader(std::span<const std::byte> bytes) : bytes_(bytes) {}

  template <class T>
  requires std::is_arithmetic_v<T> T take() {
    T value{};
    if (bytes_.size() < sizeof value) {
      whole_ = false;
      bytes_ = {};
      return value;
    }
    std::memcpy(&value, bytes_.data(), sizeof value);
    bytes_ = bytes_.subspan(sizeof value);
    return value;
  }
  std::size_t remaining() const { return bytes_.size(); }
  std::span<const std::byte> rest() const { return bytes_; }
  bool whole() const { return whole_; }

 private:
  std::span<const std::byte> bytes_;
  bool whole_ = true;
};

template <class T>
void put(std::vector<std::byte>& to, T value) {
  const auto* bytes = reinterpret_cast<const std::byte*>(&value);
  to.insert(to.end(), bytes, bytes + sizeof value);
}

Eigen::Vector3f takeVector(FrameReader& in) {
  Eigen::Vector3f v;
  for (int axis = 0; axis < 3; ++axis) v[axis] = in.take<float>();
  return v;
}

bool takeGeometry(std::span<const std::byte> body, IfcShapes& shapes) {
  FrameReader in(body);
  const auto id = in.take<std::uint32_t>();
  const auto vertices = in.take<std::uint32_t>();
  const auto indices = in.take<std::uint32_t>();
  const std::uint64_t size = std::uint64_t{vertices} * 24 + std::uint64_t{indices} * 4;
  if (!in.whole() || in.remaining() != size || indices % 3 != 0) return false;
  IfcGeometry geometry;
  for (std::uint32_t i = 0; i < vertices; ++i) {
    geometry.positions.push_back(takeVector(in));
    geometry.normals.push_back(takeVector(in));
  }
  for (std::uint32_t i = 0; i < indices; ++i) {
    geometry.indices.push_back(in.take<std::uint32_t>());
    if (geometry.indices.back() >= vertices) return false;
  }
  shapes.geometries[id] = std::move(geometry);
  return true;
}

bool takePart(FrameReader& in, IfcShapes& shapes, std::vector<IfcPart>& parts) {
  IfcPart part;
  part.geometry = in.take<std::uint32_t>();
  for (int i = 0; i < 4; ++i) {
    const auto channel = in.take<double>();
    part.colour[i] = static_cast<float>(channel > 0 ? std::min(channel, 1.0) : 0.0);
  }
  for (int column = 0; column < 4; ++column) {
    for (int row = 0; row < 4; ++row)
      part.worldFromGeometry.matrix()(row, column) = in.take<double>();
  }
  part.worldFromGeometry.makeAffine();
  if (!in.whole() || !shapes.geometries.contains(part.geometry)) return false;
  const auto& m = part.worldFromGeometry.matrix();
  if (m.allFinite() && m.cwiseAbs().maxCoeff() <= kGreatestEntry) parts.push_back(part);
  return true;
}

bool takeProduct(std::span<const std::byte> body, IfcShapes& shapes) {
  FrameReader in(body);
  const auto id = in.take<std::uint32_t>();
  const auto count = in.take<std::uint32_t>();
  std::vector<IfcPart> parts;
  for (std::uint32_t i = 0; i < count; ++i) {
    if (!takePart(in, shapes, parts)) return false;
  }
  if (!in.whole() || in.remaining() != 0) return false;
  std::vector<IfcPart>& known = shapes.products[id];
  known.insert(known.end(), parts.begin(), parts.end());
  return true;
}

bool takeFailure(std::span<const std::byte> body, IfcShapes& shapes) {
  FrameReader in(body);
  const auto id = in.take<std::uint32_t>();
  if (!in.whole()) return false;
  const auto text = in.rest();
  shapes.failures[id] = {reinterpret_cast<const char*>(text.data()), text.size()};
  return true;
}

}  // namespace

std::size_t IfcShapes::triangles(std::uint32_t product) const {
  const auto found = products.find(product);
  std::size_t count = 0;
  if (found == products.end()) return 0;
  for (const IfcPart& part : found->second) {
    count += geometries.at(part.geometry).indices.size() / 3;
  }
  return count;
}

bool takeShapes(ImportFrame kind, std::span<const std::byte> body, IfcShapes& shapes) {
  if (kind == ImportFrame::geometry) return takeGeometry(body, shapes);
  if (kind == ImportFrame::product) return takeProduct(body, shapes);
  if (kind == ImportFrame::failure) return takeFailure(body, shapes);
  return false;
}

void sendGeometry(std::uint32_t id, const IfcGeometry& geometry) {
  std::vector<std::byte> frame;
  put(frame, id);
  put(frame, static_cast<std::uint32_t>(geometry.positions.size()));
  put(frame, static_cast<std::uint32_t>(geometry.indices.size()));
  for (std::size_t i = 0; i < geometry.positions.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) put(frame, geometry.positions[i][axis]);
    for (int axis = 0; axis < 3; ++axis) put(frame, geometry.normals[i][axis]);
  }
  for (const std::uint32_t index : geometry.indices) put(frame, index);
  sendFrame(ImportFrame::geometry, frame.data(), frame.size());
}

void sendProduct(std::uint32_t id, const std::vector<IfcPart>& parts) {
  std::vector<std::byte> frame;
  put(frame, id);
  put(frame, static_cast<std::uint32_t>(parts.size()));
  for (const IfcPart& part : parts) {
    put(frame, part.geometry);
    for (int i = 0; i < 4; ++i) put(frame, static_cast<double>(part.colour[i]));
    for (int column = 0; column < 4; ++column) {
      for (int row = 0; row < 4; ++row) put(frame, part.worldFromGeometry.matrix()(row, column));
    }
  }
  sendFrame(ImportFrame::product, frame.data(), frame.size());
}

}  // namespace enfilade::scene
