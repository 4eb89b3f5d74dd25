// Convex hull by lexicographic insertion ("beneath-beyond"), with exact orientation tests.
//
// 1. Points are sorted lexicographically and made unique. Each next point then lies outside the
//    hull of the previous points, and a face at the last inserted point is visible from it.
// 2. While all points so far lie on one point, line or plane, the hull is a point, a segment or a
//    polygon (monotone chain, A. M. Andrew 1979). The first point off the plane makes a pyramid.
// 3. Each further point replaces the strictly visible triangles by a cone over their horizon
//    ("beneath-beyond", M. Kallay 1981). Triangles whose plane contains the point are kept: the
//    point is never on the line of a horizon edge, so no triangle is degenerate.
// 4. Coplanar triangles are merged into convex polygons. Points inside faces or edges are dropped.
//
// Faces and vertices are sorted, so the result depends on the set of points and not on their order.

#include "collision/shapes/hull.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>
#include <string>

#include "collision/assert.hpp"
#include "collision/shapes/exact_orientation.hpp"

namespace enfilade::collision {
namespace {

using Index = std::uint32_t;
using Polygon = std::vector<Index>;

bool isLexicographicallyLess(const Vec3& a, const Vec3& b) {
  if (a.x() != b.x()) return a.x() < b.x();
  if (a.y() != b.y()) return a.y() < b.y();
  return a.z() < b.z();
}

std::vector<Vec3> sortUnique(std::span<const Vec3> points) {
  if (points.empty()) {
    throw std::invalid_argument("buildHull: no points; give at least one");
  }
  std::vector<Vec3> result;
  result.reserve(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!points[i].allFinite()) {
      throw std::invalid_argument("buildHull: point " + std::to_string(i) +
                                  " is not finite; drop or repair it");
    }
    result.emplace_back(points[i] + Vec3::Zero());  // -0 becomes 0: same point, same bits
  }
  std::sort(result.begin(), result.end(), isLexicographicallyLess);
  result.erase(std::unique(result.begin(), result.end()), result.end());
  return result;
}

/// Convex polygon around coplanar points that are not all collinear: indices of its corners,
/// anticlockwise seen along -axis `dropped`. The plane must not be parallel to that axis.
Polygon buildConvexPolygon(std::span<const Vec3> points, int dropped) {
  ENFILADE_ASSERT(points.size() >= 3);
  const int i = (dropped + 1) % 3;
  const int j = (dropped + 2) % 3;
  Polygon order(points.size());
  for (Index k = 0; k < order.size(); ++k) order[k] = k;
  std::sort(order.begin(), order.end(), [&](Index a, Index b) {
    return points[a][i] != points[b][i] ? points[a][i] < points[b][i] : points[a][j] < points[b][j];
  });
  Polygon chain;
  const auto append = [&](Index next, std::size_t keep) {
    while (chain.size() >= keep + 2 && orient2d(points[chain[chain.size() - 2]],
                                                points[chain.back()], points[next], dropped) <= 0) {
      chain.pop_back();
    }
    chain.push_back(next);
  };
  for (const Index next : order) append(next, 0);
  const std::size_t lower = chain.size() - 1;
  for (std::size_t k = order.size() - 1; k-- > 0;) append(order[k], lower);
  chain.pop_back();  // the first point, repeated
  ENFILADE_ASSERT(chain.size() >= 3);
  return chain;
}

/// First axis to which the plane of three non-collinear points is not parallel.
int findProjectionAxis(const Vec3& a, const Vec3& b, const Vec3& c) {
  for (int axis = 0; axis < 2; ++axis) {
    if (orient2d(a, b, c, axis) != 0) return axis;
  }
  return 2;
}

/// Closed triangle mesh of the hull, extended point by point (step 3 of the file head).
class TriangleHull {
 public:
  explicit TriangleHull(std::span<const Vec3> points) : points_(points) {}

  /// `base` is convex, and anticlockwise seen from the side opposite to `apex`.
  void startPyramid(const Polygon& base, Index apex) {
    ENFILADE_ASSERT(base.size() >= 3);
    const Index corners = static_cast<Index>(base.size());
    for (Index k = 1; k + 1 < corners; ++k) {
      const Index self = static_cast<Index>(triangles_.size());
      const Index before = k == 1 ? corners - 2 : self - 1;
      const Index after = k + 2 == corners ? corners - 2 + corners - 1 : self + 1;
      triangles_.push_back({{base[0], base[k], base[k + 1]}, {before, corners - 2 + k, after}});
    }
    for (Index k = 0; k < corners; ++k) {
      const Index under = k == 0 ? 0 : k == corners - 1 ? corners - 3 : k - 1;
      triangles_.push_back(
          {{base[(k + 1) % corners], base[k], apex},
           {under, corners - 2 + (k + corners - 1) % corners, corners - 2 + (k + 1) % corners}});
    }
    lastFan_.clear();
    for (Index k = 0; k < corners; ++k) lastFan_.push_back(corners - 2 + k);
  }

  void insert(Index point) {
    collectVisible(point);
    buildCone(point);
  }

  std::vector<Polygon> mergeFaces();

 private:
  struct Triangle {
    std::array<Index, 3> corner;
    std::array<Index, 3> adjacent;  ///< triangle across the edge corner[i], corner[i + 1]
    bool alive = true;
    bool visible = false;
  };
  struct HorizonEdge {
    Index from, to;
    Index adjacent;  ///< triangle that is not visible
  };

  bool isVisibleFrom(Index point, const Triangle& t) const {
    return orient3d(points_[t.corner[0]], points_[t.corner[1]], points_[t.corner[2]],
                    points_[point]) > 0;
  }

  void collectVisible(Index point);
  void buildCone(Index point);
  static Index findOppositeCorner(const Triangle& t, Index neighbour);
  std::vector<Index> groupCoplanarTriangles() const;

  std::span<const Vec3> points_;
  std::vector<Triangle> triangles_;
  std::vector<Index> lastFan_;  ///< triangles at the last inserted point
  std::vector<Index> visible_;
  std::vector<HorizonEdge> horizon_;
  std::vector<Index> fanAt_ = std::vector<Index>(points_.size());  ///< triangle by `from` point
};

void TriangleHull::collectVisible(Index point) {
  visible_.clear();
  horizon_.clear();
  for (const Index t : lastFan_) {
    if (!isVisibleFrom(point, triangles_[t])) continue;
    triangles_[t].visible = true;
    visible_.push_back(t);
    break;
  }
  if (visible_.empty())
    throw std::logic_error("buildHull: no face is visible from an outside point");
  for (std::size_t next = 0; next < visible_.size(); ++next) {
    const Triangle t = triangles_[visible_[next]];
    for (std::size_t e = 0; e < 3; ++e) {
      Triangle& other = triangles_[t.adjacent[e]];
      if (other.visible) continue;
      if (isVisibleFrom(point, other)) {
        other.visible = true;
        visible_.push_back(t.adjacent[e]);
      } else {
        horizon_.push_back({t.corner[e], t.corner[(e + 1) % 3], t.adjacent[e]});
      }
    }
  }
}

void TriangleHull::buildCone(Index point) {
  ENFILADE_ASSERT(horizon_.size() >= 3);
  for (const Index t : visible_) triangles_[t].alive = false;
  lastFan_.clear();
  for (const HorizonEdge& edge : horizon_) {
    const Index self = static_cast<Index>(triangles_.size());
    fanAt_[edge.from] = self;
    triangles_.push_back({{edge.from, edge.to, point}, {edge.adjacent, 0, 0}});
    lastFan_.push_back(self);
    Triangle& neighbour = triangles_[edge.adjacent];
    for (std::size_t e = 0; e < 3; ++e) {
      if (neighbour.corner[e] == edge.to && neighbour.corner[(e + 1) % 3] == edge.from) {
        neighbour.adjacent[e] = self;
      }
    }
  }
  for (const Index t : lastFan_) {
    const Index next = fanAt_[triangles_[t].corner[1]];
    triangles_[t].adjacent[1] = next;
    triangles_[next].adjacent[2] = t;
  }
}

/// Corner of `t` that its neighbour does not share.
Index TriangleHull::findOppositeCorner(const Triangle& t, Index neighbour) {
  const std::size_t edge = t.adjacent[0] == neighbour ? 0 : t.adjacent[1] == neighbour ? 1 : 2;
  return t.corner[(edge + 2) % 3];
}

/// For each triangle, the index of the first triangle in its coplanar group.
std::vector<Index> TriangleHull::groupCoplanarTriangles() const {
  constexpr Index kNone = static_cast<Index>(-1);
  std::vector<Index> plane(triangles_.size(), kNone);
  std::vector<Index> open;
  for (Index first = 0; first < triangles_.size(); ++first) {
    if (!triangles_[first].alive || plane[first] != kNone) continue;
    plane[first] = first;
    open.assign(1, first);
    while (!open.empty()) {
      const Index inPlane = open.back();
      const Triangle& t = triangles_[inPlane];
      open.pop_back();
      for (const Index other : t.adjacent) {
        if (plane[other] != kNone) continue;
        const Index apex = findOppositeCorner(triangles_[other], inPlane);
        if (orient3d(points_[t.corner[0]], points_[t.corner[1]], points_[t.corner[2]],
                     points_[apex]) != 0)
          continue;
        plane[other] = first;
        open.push_back(other);
      }
    }
  }
  return plane;
}

std::vector<Polygon> TriangleHull::mergeFaces() {
  const std::vector<Index> plane = groupCoplanarTriangles();
  struct HalfEdge {
    Index plane, from, to;
    auto operator<=>(const HalfEdge&) const = default;
  };
  std::vector<HalfEdge> edges;
  std::vector<Index> planesAt(points_.size(), 0);  // outgoing border edges: one per plane
  for (Index t = 0; t < triangles_.size(); ++t) {
    if (!triangles_[t].alive) continue;
    for (std::size_t e = 0; e < 3; ++e) {
      if (plane[triangles_[t].adjacent[e]] == plane[t]) continue;
      edges.push_back({plane[t], triangles_[t].corner[e], triangles_[t].corner[(e + 1) % 3]});
      ++planesAt[triangles_[t].corner[e]];
    }
  }
  std::sort(edges.begin(), edges.end());
  std::vector<Polygon> faces;
  for (auto first = edges.begin(); first != edges.end();) {
    const auto last = std::upper_bound(first, edges.end(), first->plane,
                                       [](Index p, const HalfEdge& e) { return p < e.plane; });
    Polygon face;
    auto edge = first;
    do {
      if (planesAt[edge->from] >= 3) face.push_back(edge->from);
      edge = std::lower_bound(first, last, edge->to,
                              [](const HalfEdge& e, Index from) { return e.from < from; });
    } while (edge != first);
    ENFILADE_ASSERT(face.size() >= 3);
    faces.push_back(std::move(face));
    first = last;
  }
  return faces;
}

std::vector<Polygon> buildFaces(std::span<const Vec3> points) {
  const std::size_t count = points.size();
  std::size_t offLine = 2;
  while (offLine < count && areCollinear(points[0], points[1], points[offLine])) ++offLine;
  if (offLine >= count) return {};
  std::size_t offPlane = offLine + 1;
  while (offPlane < count &&
         orient3d(points[0], points[1], points[offLine], points[offPlane]) == 0) {
    ++offPlane;
  }
  Polygon base = buildConvexPolygon(points.first(std::min(offPlane, count)),
                                    findProjectionAxis(points[0], points[1], points[offLine]));
  if (offPlane >= count) return {base, Polygon(base.rbegin(), base.rend())};
  if (orient3d(points[base[0]], points[base[1]], points[base[2]], points[offPlane]) > 0) {
    std::reverse(base.begin(), base.end());
  }
  TriangleHull hull(points);
  hull.startPyramid(base, static_cast<Index>(offPlane));
  for (std::size_t p = offPlane + 1; p < count; ++p) hull.insert(static_cast<Index>(p));
  return hull.mergeFaces();
}

/// Fills the adjacency lists. Faces of a closed surface use each edge once in each direction.
void linkNeighbours(Hull& hull) {
  const auto eachEdge = [&](const auto& visit) {
    for (const Polygon& face : hull.faces)
      for (std::size_t k = 0; k < face.size(); ++k) visit(face[k], face[(k + 1) % face.size()]);
    if (hull.faces.empty() && hull.vertices.size() == 2) {
      visit(0, 1);
      visit(1, 0);
    }
  };
  std::vector<Index>& start = hull.neighbourOffsets;
  start.assign(hull.vertices.size() + 1, 0);
  eachEdge([&](Index from, Index) { ++start[from + 1]; });
  for (std::size_t v = 1; v < start.size(); ++v) start[v] += start[v - 1];
  hull.neighbours.resize(start.back());
  std::vector<Index> next(start.begin(), start.end() - 1);
  eachEdge([&](Index from, Index to) { hull.neighbours[next[from]++] = to; });
  for (std::size_t v = 0; v + 1 < start.size(); ++v)
    std::sort(hull.neighbours.begin() + start[v], hull.neighbours.begin() + start[v + 1]);
}

/// Keeps only the points that are corners of faces, in order, and renumbers the faces.
void keepCorners(Hull& hull, std::span<const Vec3> points, std::vector<Polygon> faces) {
  std::vector<Index> newIndex(points.size(), 0);
  for (const Polygon& face : faces) {
    for (const Index corner : face) newIndex[corner] = 1;
  }
  for (std::size_t p = 0; p < points.size(); ++p) {
    if (newIndex[p] == 0) continue;
    newIndex[p] = static_cast<Index>(hull.vertices.size());
    hull.vertices.push_back(points[p]);
  }
  for (Polygon& face : faces) {
    for (Index& corner : face) corner = newIndex[corner];
    std::rotate(face.begin(), std::min_element(face.begin(), face.end()), face.end());
  }
  std::sort(faces.begin(), faces.end());
  hull.faces = std::move(faces);
}

/// Maximum norm, scaled so that squares neither overflow nor underflow.
double computeMaxNorm(std::span<const Vec3> points) {
  double largest = 0, maxNorm = 0;
  for (const Vec3& p : points) largest = std::max(largest, p.cwiseAbs().maxCoeff());
  if (largest == 0) return 0;
  for (const Vec3& p : points) {
    const double x = p.x() / largest, y = p.y() / largest, z = p.z() / largest;
    maxNorm = std::max(maxNorm, std::sqrt(x * x + y * y + z * z));
  }
  return maxNorm * largest;
}

// ---- validate ----------------------------------------------------------------------------------

[[noreturn]] void throwInvalidHull(const std::string& what) {
  throw std::logic_error("hull: " + what);
}

void validateEdges(const Hull& hull) {
  std::set<std::pair<Index, Index>> edges;
  for (std::size_t f = 0; f < hull.faces.size(); ++f) {
    const Polygon& face = hull.faces[f];
    if (face.size() < 3)
      throwInvalidHull("face " + std::to_string(f) + " has fewer than 3 corners");
    for (std::size_t k = 0; k < face.size(); ++k) {
      if (face[k] >= hull.vertices.size()) {
        throwInvalidHull("face " + std::to_string(f) + " has an invalid vertex index");
      }
      if (!edges.emplace(face[k], face[(k + 1) % face.size()]).second) {
        throwInvalidHull("face " + std::to_string(f) + " repeats an edge of another face");
      }
    }
  }
  for (const auto& [from, to] : edges) {
    if (!edges.contains({to, from})) {
      throwInvalidHull("edge " + std::to_string(from) + "-" + std::to_string(to) +
                       " has only one face");
    }
  }
  const std::size_t edgeCount = edges.size() / 2;
  const std::size_t euler = hull.faces.empty() ? 0 : 2;
  if (euler == 2 && hull.vertices.size() + hull.faces.size() != edgeCount + euler) {
    throwInvalidHull("Euler's formula fails: " + std::to_string(hull.vertices.size()) +
                     " vertices, " + std::to_string(edgeCount) + " edges, " +
                     std::to_string(hull.faces.size()) + " faces");
  }
}

void validateNeighbours(const Hull& hull) {
  Hull expected;
  expected.vertices = hull.vertices;
  expected.faces = hull.faces;
  linkNeighbours(expected);
  if (expected.neighbourOffsets != hull.neighbourOffsets ||
      expected.neighbours != hull.neighbours) {
    throwInvalidHull("the neighbour lists do not match the edges of the faces");
  }
}

/// Checks that the face is strictly convex: all its corners have the same orientation.
void validatePolygon(const Hull& hull, std::size_t f) {
  const Polygon& face = hull.faces[f];
  const auto at = [&](std::size_t k) -> const Vec3& {
    return hull.vertices[face[k % face.size()]];
  };
  const int axis = findProjectionAxis(at(0), at(1), at(2));
  const int sense = orient2d(at(0), at(1), at(2), axis);
  for (std::size_t k = 0; k < face.size(); ++k) {
    if (sense == 0 || orient2d(at(k), at(k + 1), at(k + 2), axis) != sense) {
      throwInvalidHull("face " + std::to_string(f) + " is not strictly convex");
    }
  }
}

void validateSide(const Hull& hull, std::size_t f) {
  const Polygon& face = hull.faces[f];
  for (Index v = 0; v < hull.vertices.size(); ++v) {
    const int side = orient3d(hull.vertices[face[0]], hull.vertices[face[1]],
                              hull.vertices[face[2]], hull.vertices[v]);
    const bool corner = std::find(face.begin(), face.end(), v) != face.end();
    if (side > 0 || (side == 0) != corner) {
      throwInvalidHull("vertex " + std::to_string(v) + " is " +
                       (side > 0 ? "outside" : "in the plane") + " of face " + std::to_string(f));
    }
  }
}

}  // namespace

Hull buildHull(std::span<const Vec3> points) {
  const std::vector<Vec3> sorted = sortUnique(points);
  Hull hull;
  std::vector<Polygon> faces = buildFaces(sorted);
  if (faces.empty()) {
    hull.vertices.push_back(sorted.front());
    if (sorted.size() > 1) hull.vertices.push_back(sorted.back());
  } else {
    keepCorners(hull, sorted, std::move(faces));
  }
  linkNeighbours(hull);
  hull.radius = computeMaxNorm(hull.vertices);
#ifndef NDEBUG
  validateHull(hull);
#endif
  return hull;
}

void validateHull(const Hull& hull) {
  if (hull.vertices.empty()) throwInvalidHull("no vertices");
  if (hull.faces.size() == 1 || hull.faces.size() == 3)
    throwInvalidHull("1 or 3 faces are not closed");
  if (hull.faces.empty() && hull.vertices.size() > 2)
    throwInvalidHull("3 or more vertices without faces");
  validateEdges(hull);
  validateNeighbours(hull);
  for (std::size_t f = 0; f < hull.faces.size(); ++f) {
    validatePolygon(hull, f);
    validateSide(hull, f);
  }
  if (hull.radius != computeMaxNorm(hull.vertices))
    throwInvalidHull("the radius does not match the vertices");
}

}  // namespace enfilade::collision
