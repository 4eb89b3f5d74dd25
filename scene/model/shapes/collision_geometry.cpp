#include "scene/model/shapes/collision_geometry.hpp"

#include <algorithm>
#include <cmath>

#include "collision/assert.hpp"
#include "scene/model/shapes/mesh_to_hull.hpp"

namespace enfilade::scene {
namespace {

constexpr std::uint32_t kLeafSize = 4;  // hulls; as for triangles, see triangle_tree.cpp

/// An integer near the middle of low..high that can be subtracted from every number between them
/// without rounding. By Sterbenz' lemma this holds for numbers between its half and its double.
double findExactOrigin(double low, double high) {
  const double middle = std::round(0.5 * low + 0.5 * high);
  const double minMagnitude = low > 0 ? low : -high, maxMagnitude = low > 0 ? high : -low;
  const double size = std::abs(middle);
  return size <= 2 * minMagnitude && maxMagnitude <= 2 * size ? middle : 0;
}

Vec3 computeOrigin(const PlacedShape& placed) {
  Aabb box;
  for (std::uint32_t v = 0; v < placed.shape.vertices.size(); ++v)
    box.include(placed.vertexPosition(v));
  if (box.empty()) return Vec3::Zero();
  return {findExactOrigin(box.min.x(), box.max.x()), findExactOrigin(box.min.y(), box.max.y()),
          findExactOrigin(box.min.z(), box.max.z())};
}

collision::Triangle makeRelative(collision::Triangle triangle, const Vec3& origin) {
  for (Vec3& corner : triangle) corner -= origin;
  return triangle;
}

void addHull(collision::Hull hull, CollisionGeometry& geometry) {
  Aabb box;
  for (const Vec3& v : hull.vertices) box.include(v + geometry.origin);
  geometry.hullBoxes.push_back(box);
  geometry.localHulls.push_back(std::move(hull));
}

}  // namespace

bool hasNumericalArea(const collision::Triangle& t) {
  // Equal corners need a test of their own: their cross product is zero only up to overflow.
  if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) return false;
  return !(t[1] - t[0]).cross(t[2] - t[0]).isZero(0.0);
}

CollisionGeometry buildCollisionGeometry(const Shape& shape, const Eigen::Affine3d& transform) {
  const PlacedShape placed{shape, transform};
  CollisionGeometry geometry;
  geometry.origin = computeOrigin(placed);
  std::vector<collision::Triangle> triangles;
  std::vector<signed char> windingSigns;
  const signed char outside = transform.linear().determinant() < 0 ? -1 : 1;
  for (const Shell& shell : shape.shells) {
    if (isTreatedAsHull(placed, shell)) {
      addHull(buildShellHull(placed, {&shell, 1}, geometry.origin), geometry);
      continue;
    }
    for (std::size_t t = shell.first; t < shell.first + shell.count; ++t) {
      const auto triangle = makeRelative(placed.triangle(t), geometry.origin);
      if (!hasNumericalArea(triangle)) continue;
      triangles.push_back(triangle);
      windingSigns.push_back(shell.bounds() ? outside : static_cast<signed char>(0));
    }
  }
  if (!geometry.localHulls.empty())
    geometry.hullTree = collision::buildBoxTree(geometry.hullBoxes, kLeafSize);
  if (triangles.empty()) return geometry;
  geometry.localTriangles = collision::TriangleTree(triangles);
  for (std::uint32_t i = 0; i < triangles.size(); ++i) {
    geometry.windingSigns.push_back(windingSigns[geometry.localTriangles.inputIndex(i)]);
  }
  return geometry;
}

collision::PlacedConvex CollisionGeometry::convex(std::uint32_t part) const {
  if (const collision::Hull* own = hull(part)) return {own->vertices, origin, nullptr, own};
  const collision::Triangle& t = localTriangles.triangles()[part - hullCount()];
  return {std::span<const Vec3>(t), origin};
}

Aabb CollisionGeometry::box(std::uint32_t part) const {
  if (part < hullCount()) return hullBoxes[part];
  const Aabb local = collision::computeAabb(localTriangles.triangles()[part - hullCount()]);
  return {local.min + origin, local.max + origin};
}

void CollisionGeometry::query(const Aabb& box, std::vector<std::uint32_t>& parts) const {
  const auto begin = static_cast<std::ptrdiff_t>(parts.size());
  collision::forEachOverlappingLeaf(hullTree, collision::toFloatAabb(box, hullTree.origin),
                                    [&](std::uint32_t first, std::uint32_t count) {
                                      for (std::uint32_t i = first; i < first + count; ++i) {
                                        const std::uint32_t hull = hullTree.order[i];
                                        if (overlaps(hullBoxes[hull], box)) parts.push_back(hull);
                                      }
                                    });
  std::sort(parts.begin() + begin, parts.end());
  // The subtraction may round: query two units wider, then filter exactly.
  const Vec3 rounding = 0x1p-51 * box.min.cwiseAbs().cwiseMax(box.max.cwiseAbs());
  const auto hullsEnd = static_cast<std::ptrdiff_t>(parts.size());
  localTriangles.query({box.min - origin - rounding, box.max - origin + rounding}, parts);
  for (auto part = parts.begin() + hullsEnd; part != parts.end(); ++part) *part += hullCount();
  parts.erase(std::remove_if(parts.begin() + hullsEnd, parts.end(),
                             [&](std::uint32_t part) { return !overlaps(this->box(part), box); }),
              parts.end());
  ENFILADE_ASSERT(std::is_sorted(parts.begin() + begin, parts.end()));
}

std::size_t CollisionGeometry::bytes() const {
  std::size_t sum = sizeof *this + windingSigns.capacity() + hullBoxes.capacity() * sizeof(Aabb) +
                    localTriangles.triangles().capacity() * sizeof(collision::Triangle);
  for (const collision::BoxTree* tree : {&hullTree, &localTriangles.boxes()}) {
    sum += tree->nodes.capacity() * sizeof(collision::BoxTree::Node) +
           tree->order.capacity() * sizeof(std::uint32_t);
  }
  for (const collision::Hull& hull : localHulls) {
    sum += sizeof hull + hull.vertices.capacity() * sizeof(Vec3);
    sum += (hull.neighbourOffsets.capacity() + hull.neighbours.capacity()) * sizeof(std::uint32_t);
    for (const auto& face : hull.faces) sum += sizeof face + face.capacity() * sizeof(face[0]);
  }
  return sum;
}

std::vector<collision::CompoundView> makeCompoundViews(const CollisionGeometry& geometry) {
  std::vector<collision::CompoundView> views;
  const collision::BoxTree& triangles = geometry.localTriangles.boxes();
  if (!geometry.hullTree.empty())
    views.push_back(
        {&geometry.hullTree, collision::Mat3::Identity(), Vec3::Zero(),
         [&geometry](std::uint32_t item) { return geometry.convex(geometry.hullTree.order[item]); },
         [&geometry](std::uint32_t item) { return geometry.box(geometry.hullTree.order[item]); }});
  if (!triangles.empty())
    views.push_back(
        {&triangles, collision::Mat3::Identity(), geometry.origin,
         [&geometry](std::uint32_t item) { return geometry.convex(geometry.hullCount() + item); },
         [&geometry](std::uint32_t item) { return geometry.box(geometry.hullCount() + item); }});
  return views;
}

int computeCrossing(const collision::Triangle& t, const Vec3& point) {
  const Vec3 ray{0.8017, 0.5345, 0.2673};  // parallel to no axis of any building
  const std::array<Vec3, 3> p{t[0] - point, t[1] - point, t[2] - point};
  std::array<double, 3> area;
  for (std::size_t i = 0; i < 3; ++i) area[i] = ray.dot(p[i].cross(p[(i + 1) % 3]));
  const bool leaves = area[0] > 0 && area[1] > 0 && area[2] > 0;
  const bool enters = area[0] < 0 && area[1] < 0 && area[2] < 0;
  if (!leaves && !enters) return 0;
  const Vec3 normal = (p[1] - p[0]).cross(p[2] - p[0]);
  const bool ahead = (normal.dot(p[0]) > 0) == (normal.dot(ray) > 0);
  return ahead ? (leaves ? 1 : -1) : 0;
}

bool isInsideTriangleShells(const CollisionGeometry& geometry, const Vec3& point) {
  int winding = 0;
  const auto& triangles = geometry.localTriangles.triangles();
  const Vec3 local = point - geometry.origin;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    if (geometry.windingSigns[i] != 0)
      winding += geometry.windingSigns[i] * computeCrossing(triangles[i], local);
  }
  return winding > 0;
}

std::vector<collision::Triangle> collectSolidTriangles(const Model& model, std::uint32_t object) {
  std::vector<collision::Triangle> triangles;
  const Object& placed = model.objects[object];
  std::vector<Vec3> worldPositions;
  for (const std::uint32_t meshIndex : placed.meshes) {
    const Mesh& mesh = model.meshes[meshIndex];
    worldPositions.resize(mesh.positions.size());
    for (std::uint32_t v = 0; v < worldPositions.size(); ++v)
      worldPositions[v] = computeWorldPosition(placed, mesh, v);
    for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
      const collision::Triangle t{worldPositions[mesh.indices[i]],
                                  worldPositions[mesh.indices[i + 1]],
                                  worldPositions[mesh.indices[i + 2]]};
      if (hasNumericalArea(t)) triangles.push_back(t);
    }
  }
  return triangles;
}

}  // namespace enfilade::scene
