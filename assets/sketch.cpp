#include "assets/sketch.hpp"

#include <cmath>
#include <stdexcept>

namespace enfilade::assets {
namespace {

template <typename T>
void appendBytes(std::string& bytes, const std::vector<T>& values) {
  bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
}

/// Rounds to the micrometre, so that equal sizes from different coordinates become equal.
double roundToMicrometre(double metres) {
  return std::floor(metres * 1e6 + 0.5) / 1e6;
}

}  // namespace

Sketch::Sketch() {
  model_.materials = makePaletteMaterials();
}

std::uint32_t Sketch::findOrAddMesh(const PaintedMesh::Part& part, const std::string& name) {
  scene::Mesh mesh;
  for (const Vec3& p : part.positions) mesh.positions.push_back(p.cast<float>());
  for (const Vec3& n : part.normals) mesh.normals.push_back(n.cast<float>());
  mesh.indices = part.indices;
  mesh.material = static_cast<std::uint32_t>(part.paint);
  std::string bytes = std::to_string(mesh.material) + ' ' + std::to_string(mesh.positions.size());
  appendBytes(bytes, mesh.positions);
  appendBytes(bytes, mesh.normals);
  appendBytes(bytes, mesh.indices);
  const auto index = static_cast<std::uint32_t>(model_.meshes.size());
  const auto [entry, isNew] = meshes_.emplace(std::move(bytes), index);
  if (isNew) {
    mesh.name = name.substr(name.rfind('/') + 1);
    model_.meshes.push_back(std::move(mesh));
  }
  return entry->second;
}

void Sketch::place(const std::string& path, const PaintedMesh& shape,
                   const Eigen::Affine3d& worldFromShape) {
  if (!paths_.insert(path).second) throw std::logic_error("assets: two objects named " + path);
  scene::Object object;
  object.path = path;
  object.worldFromMesh = worldFromShape;
  for (const PaintedMesh::Part& part : shape.parts)
    object.meshes.push_back(findOrAddMesh(part, path));
  model_.objects.push_back(std::move(object));
}

void Sketch::placeBox(const std::string& path, const Vec3& low, const Vec3& high,
                      const BoxPaints& paints) {
  const Vec3 half = (0.5 * (high - low)).unaryExpr([](double v) { return roundToMicrometre(v); });
  PaintedMesh shape;
  addBox(shape, -half, half, paints);
  place(path, shape, makeTranslation(0.5 * (low + high)));
}

void Sketch::placeBox(const std::string& path, const Vec3& low, const Vec3& high, Paint paint) {
  placeBox(path, low, high, paintAllFaces(paint));
}

void Sketch::setJoint(MovingPart::Kind kind, const Vec3& axis, double low, double high) {
  movingParts_.push_back(
      {static_cast<std::uint32_t>(model_.objects.size() - 1), kind, axis, low, high});
}

std::string appendNumber(const std::string& name, int number) {
  return name + (number < 10 ? "0" : "") + std::to_string(number);
}

}  // namespace enfilade::assets
