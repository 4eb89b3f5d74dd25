#include "scene/import/assembly/finish_model.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "scene/import/assembly/coordinates.hpp"
#include "scene/import/file/import_options.hpp"
#include "scene/model/add_diagnostic.hpp"
#include "scene/model/box_mesh.hpp"
#include "scene/model/diagnostic_catalog.hpp"

namespace enfilade::scene {
namespace {

constexpr double kMaxObjectDistance =
    1e7;  // metres from the scene's centre; a world accepts no more
constexpr double kInvalidExtentFactor = 10;  // times the outlier limit: some vertex must be invalid
constexpr double kOutlierFactor = 30;  // times the median distance; a town's outskirts reach 5
constexpr double kMaxOutlierFraction =
    0.05;  // of all objects; more objects form a second site instead

Aabb computeMeshAabb(const Mesh& mesh) {
  Aabb box;
  for (const std::uint32_t i : mesh.indices) box.include(mesh.positions[i].cast<double>());
  return box;
}

Aabb transformMeshAabb(const Aabb& box, const Eigen::Affine3d& transform) {
  Aabb result;
  for (unsigned corner = 0; corner < 8; ++corner)
    result.include(transform * computeBoxCorner(box, corner));
  return result;
}

Aabb computeNodeAabb(const ImportedNode& imported, const std::vector<Aabb>& meshBoxes) {
  Aabb box;
  for (const auto& p : imported.instances)
    box.include(transformMeshAabb(meshBoxes[p.mesh], p.worldFromMesh));
  return box;
}

Vec3 computeMedianCentre(const std::vector<Aabb>& boxes) {
  Vec3 centre = Vec3::Zero();
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const Aabb& box : boxes) values.push_back(box.centre()[axis]);
    centre[axis] = computeMedian(values);
  }
  return centre;
}

/// The median of the objects' centres in whole metres; zero if it is near the origin.
Vec3 computeSceneOffset(const std::vector<Aabb>& objectBoxes) {
  const Vec3 centre = computeMedianCentre(objectBoxes);
  if (!centre.allFinite() || centre.norm() <= kMaxPreciseDistance) return Vec3::Zero();
  return {std::round(centre.x()), std::round(centre.y()), std::round(centre.z())};
}

/// Transforms positions and normals. If `transform` mirrors, the winding is reversed, so that
/// outside stays outside.
Mesh transformMesh(const Mesh& mesh, const Eigen::Affine3d& transform) {
  Mesh result = mesh;
  for (Eigen::Vector3f& p : result.positions) p = (transform * p.cast<double>()).cast<float>();
  const double determinant = transform.linear().determinant();
  // Cofactors are the inverse transpose times the determinant: no division, and singular
  // transforms keep a normal.
  const Eigen::Matrix3d& m = transform.linear();
  Eigen::Matrix3d cofactors;
  cofactors.col(0) = m.col(1).cross(m.col(2));
  cofactors.col(1) = m.col(2).cross(m.col(0));
  cofactors.col(2) = m.col(0).cross(m.col(1));
  if (determinant < 0) cofactors = -cofactors;
  for (Eigen::Vector3f& n : result.normals) {
    const Vec3 normal = cofactors * n.cast<double>();
    if (normal.norm() > 0) n = normal.normalized().cast<float>();
  }
  if (determinant < 0) {
    for (std::size_t i = 0; i + 2 < result.indices.size(); i += 3) {
      std::swap(result.indices[i + 1], result.indices[i + 2]);
    }
  }
  return result;
}

/// Moves meshes with large local coordinates to their own origin, in doubles, and moves their
/// instances back. Renderers then never subtract large floats.
void recentreMeshes(std::vector<ImportedNode>& importedNodes, std::vector<Mesh>& meshes,
                    std::vector<Aabb>& meshBoxes, std::vector<Diagnostic>& diagnostics) {
  std::vector<Vec3> shifts(meshes.size(), Vec3::Zero());
  for (const ImportedNode& imported : importedNodes) {
    for (const auto& p : imported.instances) {
      const Vec3 centre = meshBoxes[p.mesh].centre();
      const double distance = (p.worldFromMesh.linear() * centre).norm();
      if (!(distance > kMaxPreciseDistance)) continue;
      if (shifts[p.mesh].isZero(0) && distance * 0x1p-23 > kMaxFloatSpacing) {
        addDiagnostic(diagnostics, "coarse_coordinates",
                      meshes[p.mesh].name + ": steps of " + std::to_string(distance * 0x1p-23) +
                          " m; export near its origin, place by its node");
      }
      shifts[p.mesh] = {std::round(centre.x()), std::round(centre.y()), std::round(centre.z())};
    }
  }
  for (ImportedNode& imported : importedNodes) {
    for (auto& p : imported.instances) p.worldFromMesh.translate(shifts[p.mesh]);
  }
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    if (shifts[i].isZero(0)) continue;
    const Eigen::Affine3d back(Eigen::Translation3d(-shifts[i]));
    meshes[i] = transformMesh(meshes[i], back);
    meshBoxes[i] = computeMeshAabb(meshes[i]);
  }
}

/// Moves the meshes that the model needs out of assimp's: each shared mesh once, plus one copy per
/// transformed mesh.
class MeshTable {
 public:
  MeshTable(std::vector<Mesh>& from, Model& model)
      : sourceMeshes_(from), model_(model), index_(from.size(), kUnused) {}

  std::uint32_t addShared(std::uint32_t mesh) {
    if (index_[mesh] == kUnused) index_[mesh] = addMesh(std::move(sourceMeshes_[mesh]));
    return index_[mesh];
  }
  std::uint32_t addTransformed(std::uint32_t mesh, const Eigen::Affine3d& transform) {
    const bool moved = index_[mesh] != kUnused;
    return addMesh(
        transformMesh(moved ? model_.meshes[index_[mesh]] : sourceMeshes_[mesh], transform));
  }

 private:
  static constexpr std::uint32_t kUnused = 0xffffffff;
  std::uint32_t addMesh(Mesh mesh) {
    if (mesh.material >= model_.materials.size()) mesh.material = 0;
    model_.meshes.push_back(std::move(mesh));
    return static_cast<std::uint32_t>(model_.meshes.size() - 1);
  }

  std::vector<Mesh>& sourceMeshes_;
  Model& model_;
  std::vector<std::uint32_t> index_;
};

/// The mesh frame of an object: that of its first mesh, unless that frame is singular and the other
/// meshes cannot be transformed into it.
Eigen::Affine3d chooseObjectFrame(const ImportedNode& imported, const Vec3& offset) {
  const Eigen::Affine3d& first = imported.instances.front().worldFromMesh;
  const bool oneFrame =
      std::all_of(imported.instances.begin(), imported.instances.end(),
                  [&](const auto& p) { return p.worldFromMesh.matrix() == first.matrix(); });
  if (oneFrame || first.linear().determinant() != 0) return first;
  return Eigen::Affine3d(Eigen::Translation3d(offset));
}

/// Takes the object out of the node and gives it one transform: meshes with another transform are
/// moved into the shared frame.
Object finishObject(ImportedNode& imported, const Vec3& offset, MeshTable& meshes) {
  Object object = std::move(imported.object);
  const Eigen::Affine3d frame = chooseObjectFrame(imported, offset);
  for (const auto& p : imported.instances) {
    if (p.worldFromMesh.matrix() == frame.matrix()) {
      object.meshes.push_back(meshes.addShared(p.mesh));
    } else {
      const Eigen::Affine3d frameFromMesh = frame.inverse(Eigen::Affine) * p.worldFromMesh;
      object.meshes.push_back(meshes.addTransformed(p.mesh, frameFromMesh));
    }
  }
  object.worldFromMesh = Eigen::Translation3d(-offset) * frame;
  movePlacement(object, -offset);
  return object;
}

/// Distances of a box from a point: that of its nearest point and of its farthest corner, metres.
struct DistanceRange {
  double min, max;
};

DistanceRange computeDistanceRange(const Aabb& box, const Vec3& centre) {
  const Vec3 low = box.min - centre, high = box.max - centre;
  return {low.cwiseMax(-high).cwiseMax(Vec3::Zero()).norm(),
          low.cwiseAbs().cwiseMax(high.cwiseAbs()).norm()};
}

/// Drops objects beyond kMaxObjectDistance, and outliers if they are few. An outlier begins farther
/// from the scene's centre than kOutlierFactor times the median distance, and than a kilometre.
/// Outliers would stretch the scene's bounds over empty space.
void dropFarObjects(std::vector<ImportedNode>& importedNodes, std::vector<Aabb>& boxes,
                    std::vector<Diagnostic>& diagnostics) {
  if (importedNodes.empty()) return;
  const Vec3 centre = computeMedianCentre(boxes);
  std::vector<double> maxDistances;
  for (const Aabb& box : boxes) maxDistances.push_back(computeDistanceRange(box, centre).max);
  const double limit = std::max(kMaxPreciseDistance, kOutlierFactor * computeMedian(maxDistances));
  const auto isOutlier = [&](const Aabb& box) {
    return !(computeDistanceRange(box, centre).min <= limit);
  };
  const auto outliers = static_cast<double>(std::count_if(boxes.begin(), boxes.end(), isOutlier));
  // Of two distant objects, neither is the outlier.
  const bool few =
      boxes.size() > 2 &&
      outliers <= std::max(1.0, kMaxOutlierFraction * static_cast<double>(boxes.size()));
  std::size_t keptCount = 0;
  for (std::size_t i = 0; i < importedNodes.size(); ++i) {
    const DistanceRange range = computeDistanceRange(boxes[i], centre);
    if (!(range.max <= kMaxObjectDistance) || (few && isOutlier(boxes[i]))) {
      addDiagnostic(diagnostics, "far_object_dropped",
                    importedNodes[i].object.path + ": " + std::to_string(std::llround(range.min)) +
                        " m from the median centre of all objects");
      continue;
    }
    if (isOutlier(boxes[i])) addDiagnostic(diagnostics, "far_object", importedNodes[i].object.path);
    if (!isOutlier(boxes[i]) && range.max > kInvalidExtentFactor * limit) {
      addDiagnostic(diagnostics, "far_reaching_object",
                    importedNodes[i].object.path + ": extends to " +
                        std::to_string(std::llround(range.max)) + " m");
    }
    if (keptCount != i) {
      importedNodes[keptCount] = std::move(importedNodes[i]);
      boxes[keptCount] = boxes[i];
    }
    ++keptCount;
  }
  importedNodes.resize(keptCount);
  boxes.resize(keptCount);
}

void reportUnusualTransforms(const std::vector<ImportedNode>& importedNodes,
                             std::vector<Diagnostic>& diagnostics) {
  for (const ImportedNode& imported : importedNodes) {
    const double determinant = imported.instances.front().worldFromMesh.linear().determinant();
    if (determinant < 0) addDiagnostic(diagnostics, "mirrored_object", imported.object.path);
    if (determinant == 0) addDiagnostic(diagnostics, "flat_object", imported.object.path);
  }
}

/// The first problems, which may be the reason.
std::string explainMissingTriangles(const std::vector<Diagnostic>& diagnostics) {
  constexpr int kMaxNamed = 3;
  std::string text;
  int named = 0;
  for (const Diagnostic& problem : diagnostics) {
    if (findDiagnosticKind(problem).severity == Severity::note) continue;
    if (named++ == kMaxNamed) break;
    text += (text.empty() ? ": " : ", ") + std::to_string(problem.count) + " " + problem.kind +
            (problem.example.empty() ? "" : " (" + problem.example + ")");
  }
  return text;
}

}  // namespace

void finishModel(std::vector<ImportedNode> importedNodes, std::vector<Mesh> meshes,
                 const std::filesystem::path& file, const std::optional<Vec3>& offset,
                 Model& model) {
  std::vector<Aabb> meshBoxes, objectBoxes;
  for (const Mesh& mesh : meshes) meshBoxes.push_back(computeMeshAabb(mesh));
  recentreMeshes(importedNodes, meshes, meshBoxes, model.diagnostics);
  for (const ImportedNode& imported : importedNodes)
    objectBoxes.push_back(computeNodeAabb(imported, meshBoxes));
  dropFarObjects(importedNodes, objectBoxes, model.diagnostics);
  if (importedNodes.empty()) {
    throw ImportError(file.string() + ": contains no usable triangles" +
                      explainMissingTriangles(model.diagnostics) + "; export it with meshes");
  }
  model.offset = offset.value_or(computeSceneOffset(objectBoxes));
  reportUnusualTransforms(importedNodes, model.diagnostics);
  MeshTable table(meshes, model);
  model.objects.reserve(importedNodes.size());
  for (ImportedNode& imported : importedNodes) {
    model.objects.push_back(finishObject(imported, model.offset, table));
  }
}

}  // namespace enfilade::scene
