#include "scene/model/shapes/collision_geometry.hpp"

#include <algorithm>
#include <cmath>

namespace enfilade::scene {
namespace {

constexpr std::uint32_t kLeafSize = 4;  // hulls: as triangles, see triangle_tree.cpp

Vec3 at(const Shape& shape, std::uint32_t vertex, const Eigen::Affine3d& placed) {
  return placed * shape.vertices[vertex].cast<double>();  // as worldPosition()
}

collision::Triangle triangleAt(const Shape& shape, std::size_t t, const Eigen::Affine3d& placed) {
  const auto& corners = shape.triangles[t];
  return {at(shape, corners[0], placed), at(shape, corners[1], placed),
          at(shape, corners[2], placed)};
}

/// 3 V / A of what the surface encloses, metres.
double thickness(const Shape& shape, const Shell& shell, const Eigen::Affine3d& placed) {
  const Vec3 origin = at(shape, shape.triangles[shell.first][0], placed);
  double sixfoldVolume = 0, doubleArea = 0;
  for (std::size_t t = shell.first; t < shell.first + shell.count; ++t) {
    const auto [a, b, c] = triangleAt(shape, t, placed);
    const Vec3 normal = (b - a).cross(c - a);
    sixfoldVolume += (a - origin).dot(normal);
    doubleArea += normal.norm();
  }
  return doubleArea > 0 ? std::abs(sixfoldVolume) / doubleArea : 0;
}

/// It looks into the solid of another surface of the shape.
bool isCavity(const Shape& shape, const Shell& shell) {
  return shell.inward && std::any_of(shape.shells.begin(), shape.shells.end(),
                                     [](const Shell& other) { return other.hollow; });
}

/// A whole number near the middle of low..high that can be subtracted from all numbers between them
/// without rounding: by P. H. Sterbenz' lemma from those between its half and its double.
double exactOrigin(double low, double high) {
  const double middle = std::round(0.5 * low + 0.5 * high);
  const double least = low > 0 ? low : -high, most = low > 0 ? high : -low;
  const double size = std::abs(middle);
  return size <= 2 * least && most <= 2 * size ? middle : 0;
}

Vec3 originFor(const Shape& shape, const Eigen::Affine3d& placed) {
  Box box;
  for (std::uint32_t v = 0; v < shape.vertices.size(); ++v) box.include(at(shape, v, placed));
  if (box.empty()) return Vec3::Zero();
  return {exactOrigin(box.min.x(), box.max.x()), exactOrigin(box.min.y(), box.max.y()),
          exactOrigin(box.min.z(), box.max.z())};
}

collision::Triangle relative(collision::Triangle triangle, const Vec3& origin) {
  for (Vec3& corner : triangle) corner -= origin;
  return triangle;
}

collision::Hull hullOf(const Shape& shape, const Shell& shell, const Eigen::Affine3d& placed,
                       const Vec3& origin) {
  std::vector<Vec3> points;
  for (const std::uint32_t v : verticesOf(shape, {&shell, 1}))
    points.emplace_back(at(shape, v, placed) - origin);
  return collision::buildHull(points);
}

void addHull(collision::Hull hull, ObjectParts& parts) {
  Box box;
  for (const Vec3& v : hull.vertices) box.include(v + parts.origin);
  parts.hullBoxes.push_back(box);
  parts.localHulls.push_back(std::move(hull));
}

/// How often one surface goes around `point`, by the signed crossings of a ray: 1 inside a solid
/// whose faces look outwards. An edge seen from both its triangles gives exactly opposite areas, so
/// that a ray slips between two triangles only if it meets their edge to the last bit.
int crossing(const collision::Triangle& t, const Vec3& point) {
  const Vec3 ray{0.8017, 0.5345, 0.2673};  // no axis of any building
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

}  // namespace

bool hasArea(const collision::Triangle& t) {
  // Equal corners are asked for by themselves: their cross product is zero only up to overflow.
  if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) return false;
  return !(t[1] - t[0]).cross(t[2] - t[0]).isZero(0.0);
}

bool becomesHull(const Shape& shape, const Shell& shell, const Eigen::Affine3d& placed) {
  if (!shell.isConvex() || shell.hollow) return false;
  if (!shell.inward) return true;
  return !isCavity(shape, shell) && thickness(shape, shell, placed) < kRoomRadius;
}

ObjectParts partsOf(const Shape& shape, const Eigen::Affine3d& placed) {
  ObjectParts parts;
  parts.origin = originFor(shape, placed);
  std::vector<collision::Triangle> triangles;
  std::vector<signed char> sides;
  const signed char outside = placed.linear().determinant() < 0 ? -1 : 1;
  for (const Shell& shell : shape.shells) {
    if (becomesHull(shape, shell, placed)) {
      addHull(hullOf(shape, shell, placed, parts.origin), parts);
      continue;
    }
    for (std::size_t t = shell.first; t < shell.first + shell.count; ++t) {
      const auto triangle = relative(triangleAt(shape, t, placed), parts.origin);
      if (!hasArea(triangle)) continue;
      triangles.push_back(triangle);
      sides.push_back(shell.bounds() ? outside : static_cast<signed char>(0));
    }
  }
  if (!parts.localHulls.empty())
    parts.hullTree = collision::buildBoxTree(parts.hullBoxes, kLeafSize);
  if (triangles.empty()) return parts;
  parts.localTriangles = collision::TriangleTree(triangles);
  for (std::uint32_t i = 0; i < triangles.size(); ++i) {
    parts.sides.push_back(sides[parts.localTriangles.given(i)]);
  }
  return parts;
}

collision::ConvexBody ObjectParts::body(std::uint32_t part) const {
  if (const collision::Hull* own = hull(part)) return {own->vertices, origin, nullptr, own};
  const collision::Triangle& t = localTriangles.triangles()[part - hullCount()];
  return {std::span<const Vec3>(t), origin};
}

Box ObjectParts::box(std::uint32_t part) const {
  if (part < hullCount()) return hullBoxes[part];
  const Box local = collision::boxOf(localTriangles.triangles()[part - hullCount()]);
  return {local.min + origin, local.max + origin};
}

void ObjectParts::query(const Box& box, std::vector<std::uint32_t>& parts) const {
  const auto begin = static_cast<std::ptrdiff_t>(parts.size());
  collision::forEachLeafMeeting(hullTree, collision::narrowed(box, hullTree.origin),
                                [&](std::uint32_t first, std::uint32_t count) {
                                  for (std::uint32_t i = first; i < first + count; ++i) {
                                    const std::uint32_t hull = hullTree.order[i];
                                    if (overlaps(hullBoxes[hull], box)) parts.push_back(hull);
                                  }
                                });
  std::sort(parts.begin() + begin, parts.end());
  // The subtraction may round: two units wider, and what comes too much goes.
  const Vec3 rounding = 0x1p-51 * box.min.cwiseAbs().cwiseMax(box.max.cwiseAbs());
  const auto hullsEnd = static_cast<std::ptrdiff_t>(parts.size());
  localTriangles.query({box.min - origin - rounding, box.max - origin + rounding}, parts);
  for (auto part = parts.begin() + hullsEnd; part != parts.end(); ++part) *part += hullCount();
  parts.erase(std::remove_if(parts.begin() + hullsEnd, parts.end(),
                             [&](std::uint32_t part) { return !overlaps(this->box(part), box); }),
              parts.end());
}

std::size_t ObjectParts::bytes() const {
  std::size_t sum = sizeof *this + sides.capacity() + hullBoxes.capacity() * sizeof(Box) +
                    localTriangles.triangles().capacity() * sizeof(collision::Triangle);
  for (const collision::BoxTree* tree : {&hullTree, &localTriangles.boxes()}) {
    sum += tree->nodes.capacity() * sizeof(collision::BoxTree::Node) +
           tree->order.capacity() * sizeof(std::uint32_t);
  }
  for (const collision::Hull& hull : localHulls) {
    sum += sizeof hull + hull.vertices.capacity() * sizeof(Vec3);
    sum += (hull.neighbourStart.capacity() + hull.neighbours.capacity()) * sizeof(std::uint32_t);
    for (const auto& face : hull.faces) sum += sizeof face + face.capacity() * sizeof(face[0]);
  }
  return sum;
}

std::vector<collision::TreeOfParts> treesOf(const ObjectParts& parts) {
  std::vector<collision::TreeOfParts> trees;
  const collision::BoxTree& triangles = parts.localTriangles.boxes();
  if (!parts.hullTree.empty())
    trees.push_back(
        {&parts.hullTree, collision::Mat3::Identity(), Vec3::Zero(),
         [&parts](std::uint32_t item) { return parts.body(parts.hullTree.order[item]); }});
  if (!triangles.empty())
    trees.push_back(
        {&triangles, collision::Mat3::Identity(), parts.origin,
         [&parts](std::uint32_t item) { return parts.body(parts.hullCount() + item); }});
  return trees;
}

bool surrounds(const ObjectParts& parts, const Vec3& point) {
  int winding = 0;
  const auto& triangles = parts.localTriangles.triangles();
  const Vec3 local = point - parts.origin;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    if (parts.sides[i] != 0) winding += parts.sides[i] * crossing(triangles[i], local);
  }
  return winding > 0;
}

}  // namespace enfilade::scene
