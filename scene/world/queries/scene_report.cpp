#include "scene/world/queries/scene_report.hpp"

#include <algorithm>
#include <array>
#include <numeric>
#include <string_view>

namespace enfilade::scene {
namespace {

/// Counts problems by kind; the first example is kept.
class Findings {
 public:
  explicit Findings(std::vector<Problem>& problems) : problems_(problems) {}

  void add(const char* kind, std::size_t count, const std::string& example) {
    if (count == 0) return;
    const auto known = std::find_if(problems_.begin(), problems_.end(),
                                    [&](const Problem& p) { return p.kind == kind; });
    if (known == problems_.end()) {
      problems_.push_back({kind, count, example});
    } else {
      known->count += count;
    }
  }

 private:
  std::vector<Problem>& problems_;
};

bool told(const std::vector<Problem>& problems, const char* kind) {
  return std::any_of(problems.begin(), problems.end(),
                     [&](const Problem& p) { return p.kind == kind; });
}

/// What is odd about a shape, told of the first object that has it.
void findInShape(const Shape& shape, const std::string& path, bool degenerateTold,
                 Findings& findings) {
  if (!degenerateTold) findings.add("degenerate_triangle", shape.degenerate, path);
  findings.add("duplicate_triangle", shape.duplicate, path);
  findings.add("inconsistent_winding", shape.rewound, path);
  findings.add("non_manifold_edge", shape.crowdedEdges, path);
  findings.add("convexity_untried", shape.untried, path);
}

void countShell(const Shape& shape, const Shell& shell, const Object& object, SceneReport& report,
                Findings& findings) {
  ShellCounts& shells = report.shells;
  const bool hull = becomesHull(shape, shell, object.worldFromMesh);
  (hull ? report.hullTriangles : report.partTriangles) += shell.count;
  if (hull && shell.inward) findings.add("inside_out_solid", 1, object.path);
  if (hull) {
    ++(shell.kind == Shell::Kind::convex ? shells.exact : shells.rounded);
  } else if (shell.isConvex() && shell.hollow) {
    ++shells.hollow;
  } else if (shell.bounds() && shell.inward) {
    ++shells.inward;
    if (!shape.shells.empty() && std::none_of(shape.shells.begin(), shape.shells.end(),
                                              [](const Shell& s) { return s.hollow; })) {
      findings.add("inward_shell", 1, object.path);
    }
  } else {
    ++(shell.bounds() ? shells.closed : shells.open);
  }
}

using PlaceKey = std::array<double, 12>;

PlaceKey placeOf(const Object& object) {
  PlaceKey key{};
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column)
      key[static_cast<std::size_t>(4 * row + column)] = object.worldFromMesh(row, column);
  }
  return key;
}

/// Objects of one shape in the very same place.
void findRepeats(const Scene& scene, Findings& findings) {
  const auto& objects = scene.model().objects;
  const auto less = [&](std::uint32_t a, std::uint32_t b) {
    const std::uint32_t shapeA = scene.shapeNumber(a), shapeB = scene.shapeNumber(b);
    if (shapeA != shapeB) return shapeA < shapeB;
    return placeOf(objects[a]) < placeOf(objects[b]);
  };
  std::vector<std::uint32_t> order = scene.solidObjects();
  std::stable_sort(order.begin(), order.end(), less);
  for (std::size_t i = 1; i < order.size(); ++i) {
    if (!less(order[i - 1], order[i])) findings.add("repeated_object", 1, objects[order[i]].path);
  }
}

}  // namespace

Box boxOf(const Scene& scene, std::uint32_t object) {
  const auto& still = scene.solidObjects();
  const auto at = std::lower_bound(still.begin(), still.end(), object);
  if (at != still.end() && *at == object)
    return scene.stillBoxes()[static_cast<std::size_t>(at - still.begin())];
  Box box;
  const Eigen::Affine3d& placed = scene.model().objects[object].worldFromMesh;
  if (scene.parts(object).size() == 0) return box;
  for (const Eigen::Vector3f& v : scene.shape(object).vertices)
    box.include(placed * v.cast<double>());
  return box;
}

SceneReport reportOn(const Scene& scene) {
  const Model& model = scene.model();
  SceneReport report;
  report.objects =
      static_cast<std::size_t>(std::count_if(model.objects.begin(), model.objects.end(),
                                             [](const Object& object) { return !object.pieceOf; }));
  report.meshes = model.meshes.size();
  report.problems = model.problems;
  for (const Mesh& mesh : model.meshes) {
    report.uniqueTriangles += mesh.indices.size() / 3;
    report.uniquePositions += mesh.positions.size();
  }
  Findings findings(report.problems);
  const bool degenerateTold = told(model.problems, "degenerate_triangle");
  std::vector<bool> seen(scene.shapeCount(), false);
  for (std::uint32_t i = 0; i < model.objects.size(); ++i) {
    const Object& object = model.objects[i];
    for (const std::uint32_t mesh : object.meshes)
      report.triangles += model.meshes[mesh].indices.size() / 3;
    const Shape& shape = scene.shape(i);
    if (!seen[scene.shapeNumber(i)]) findInShape(shape, object.path, degenerateTold, findings);
    seen[scene.shapeNumber(i)] = true;
    for (const Shell& shell : shape.shells) countShell(shape, shell, object, report, findings);
    const bool solid = !boxOf(scene, i).empty();
    if (!solid) findings.add("object_without_area", 1, object.path);
    const bool counts = solid && !object.pieceOf && object.use != Object::Use::drawn;
    report.solidObjects += counts ? 1 : 0;
  }
  findRepeats(scene, findings);
  return report;
}

}  // namespace enfilade::scene
