#include "scene/world/queries/scene_report.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <functional>
#include <unordered_set>

#include "collision/assert.hpp"
#include "scene/model/add_diagnostic.hpp"
#include "scene/model/coplanar_surfaces.hpp"
#include "scene/model/shapes/mesh_to_hull.hpp"

namespace enfilade::scene {
namespace {

// 2^64 divided by the golden ratio (Knuth, multiplicative hashing); odd.
constexpr std::size_t kHashFactor = 0x9e3779b97f4a7c15;

bool hasDiagnostic(const std::vector<Diagnostic>& diagnostics, const char* kind) {
  return std::any_of(diagnostics.begin(), diagnostics.end(),
                     [&](const Diagnostic& diagnostic) { return diagnostic.kind == kind; });
}

/// Adds the defects of a shape, with the first object that has it as example.
void countShapeDefects(const Shape& shape, const std::string& path, bool degenerateReported,
                       std::vector<Diagnostic>& diagnostics) {
  if (!degenerateReported)
    addDiagnostic(diagnostics, "degenerate_triangle", path, shape.degenerate);
  addDiagnostic(diagnostics, "duplicate_triangle", path, shape.duplicate);
  addDiagnostic(diagnostics, "inconsistent_winding", path, shape.flippedTriangles);
  addDiagnostic(diagnostics, "non_manifold_edge", path, shape.nonManifoldEdges);
  addDiagnostic(diagnostics, "convexity_untried", path, shape.notTested);
}

void countShell(const Shape& shape, const Shell& shell, const Object& object, SceneReport& report) {
  ShellCounts& shells = report.shells;
  const bool hull = isTreatedAsHull({shape, object.worldFromMesh}, shell);
  (hull ? report.hullTriangles : report.partTriangles) += shell.count;
  if (hull && shell.inward) addDiagnostic(report.diagnostics, "inside_out_solid", object.path);
  if (hull) {
    ++(shell.kind == Shell::Kind::convex ? shells.exact : shells.nearlyConvex);
  } else if (shell.isConvex() && shell.hollow) {
    ++shells.hollow;
  } else if (shell.bounds() && shell.inward) {
    ++shells.inward;
    if (!shape.shells.empty() && std::none_of(shape.shells.begin(), shape.shells.end(),
                                              [](const Shell& s) { return s.hollow; })) {
      addDiagnostic(report.diagnostics, "inward_shell", object.path);
    }
  } else {
    ++(shell.bounds() ? shells.closed : shells.open);
  }
}

using TransformKey = std::array<double, 12>;

TransformKey makeTransformKey(const Object& object) {
  TransformKey key{};
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column)
      key[static_cast<std::size_t>(4 * row + column)] = object.worldFromMesh(row, column);
  }
  return key;
}

/// Counts objects with the same shape and the same transform as one before.
void countRepeatedObjects(const Scene& scene, std::vector<Diagnostic>& diagnostics) {
  const auto& objects = scene.model().objects;
  const auto computeHash = [&](std::uint32_t object) {
    std::size_t hash = scene.shapeIndex(object);
    for (const double entry : makeTransformKey(objects[object]))
      hash = std::rotl(hash * kHashFactor, 29) ^ std::hash<double>()(entry);
    return hash * kHashFactor;
  };
  const auto areEqual = [&](std::uint32_t a, std::uint32_t b) {
    return scene.shapeIndex(a) == scene.shapeIndex(b) &&
           makeTransformKey(objects[a]) == makeTransformKey(objects[b]);
  };
  std::unordered_set<std::uint32_t, decltype(computeHash), decltype(areEqual)> seen(
      scene.solidObjects().size(), computeHash, areEqual);
  for (const std::uint32_t object : scene.solidObjects())
    if (!seen.insert(object).second)
      addDiagnostic(diagnostics, "repeated_object", objects[object].path);
}

void countCoplanarSurfaces(const Model& model, std::vector<Diagnostic>& diagnostics) {
  const CoplanarSurfaces found = findCoplanarSurfaces(model);
  addDiagnostic(diagnostics, "coplanar_surfaces", found.example, found.countDifferentLooks());
  if (!found.isComplete) addDiagnostic(diagnostics, "coplanar_search_ended", model.source);
}

}  // namespace

Aabb computeAuthoredAabb(const Scene& scene, std::uint32_t object) {
  const auto& staticObjects = scene.solidObjects();
  ENFILADE_ASSERT(std::ranges::is_sorted(staticObjects));
  const auto at = std::lower_bound(staticObjects.begin(), staticObjects.end(), object);
  if (at != staticObjects.end() && *at == object)
    return scene.staticBoxes()[static_cast<std::size_t>(at - staticObjects.begin())];
  Aabb box;
  const Eigen::Affine3d& transform = scene.model().objects[object].worldFromMesh;
  if (scene.collisionGeometry(object).size() == 0) return box;
  for (const Eigen::Vector3f& v : scene.shape(object).vertices)
    box.include(transform * v.cast<double>());
  return box;
}

SceneReport makeSceneReport(const Scene& scene) {
  const Model& model = scene.model();
  SceneReport report;
  report.objects =
      static_cast<std::size_t>(std::count_if(model.objects.begin(), model.objects.end(),
                                             [](const Object& object) { return !object.partOf; }));
  report.meshes = model.meshes.size();
  report.diagnostics = model.diagnostics;
  for (const Mesh& mesh : model.meshes) {
    report.uniqueTriangles += mesh.triangleCount();
    report.uniquePositions += mesh.positions.size();
  }
  const bool degenerateReported = hasDiagnostic(model.diagnostics, "degenerate_triangle");
  std::vector<bool> seen(scene.shapeCount(), false);
  for (std::uint32_t i = 0; i < model.objects.size(); ++i) {
    const Object& object = model.objects[i];
    for (const std::uint32_t mesh : object.meshes)
      report.triangles += model.meshes[mesh].triangleCount();
    const Shape& shape = scene.shape(i);
    if (!seen[scene.shapeIndex(i)])
      countShapeDefects(shape, object.path, degenerateReported, report.diagnostics);
    seen[scene.shapeIndex(i)] = true;
    for (const Shell& shell : shape.shells) countShell(shape, shell, object, report);
    const bool solid = !computeAuthoredAabb(scene, i).empty();
    if (!solid) addDiagnostic(report.diagnostics, "object_without_area", object.path);
    const bool counts = solid && !object.partOf && object.usage != Object::Usage::visualOnly;
    report.solidObjects += counts ? 1 : 0;
  }
  countRepeatedObjects(scene, report.diagnostics);
  countCoplanarSurfaces(model, report.diagnostics);
  return report;
}

}  // namespace enfilade::scene
