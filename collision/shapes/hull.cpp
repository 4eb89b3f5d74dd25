// Convex hulls by lexicographic insertion, with exact orientation tests.
//
// 1. Points are sorted lexicographically and made unique. Each next point then lies outside of the
//    hull of those before it, and sees a face at the point inserted last.
// 2. While all points so far lie on one point, line or plane, the hull is a point, a segment or a
//    polygon (monotone chain, A. M. Andrew 1979). The first point off the plane makes a pyramid.
// 3. Every further point replaces the triangles that it sees strictly by a cone over their border
//    ("beneath-beyond", M. Kallay 1981). Triangles whose plane holds the point are left alone: the
//    point is never on the line of a border edge, so no triangle is ever without area.
// 4. Coplanar triangles are merged into convex polygons; points inside of faces or edges go.
//
// Faces and vertices are put in an order of their own, so that the result depends on the set of
// points and not on their order.

#include "collision/shapes/hull.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>
#include <string>

#include "collision/shapes/exact_orientation.hpp"

namespace enfilade::collision {
namespace {

using Index = std::uint32_t;
using Polygon = std::vector<Index>;

bool lexicographicallyLess(const Vec3& a, const Vec3& b) {
  if (a.x() != b.x()) return a.x() < b.x();
  if (a.y() != b.y()) return a.y() < b.y();
  return a.z() < b.z();
}

std::vector<Vec3> sortedUnique(std::span<const Vec3> points) {
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
  std::sort(result.begin(), result.end(), lexicographicallyLess);
  result.erase(std::unique(result.begin(), result.end()), result.end());
  return result;
}

/// The convex polygon around coplanar points that are not all on one line: indices of its corners,
/// anticlockwise seen along -axis `dropped`, on which the points' plane must not stand edge-on.
Polygon polygonAround(std::span<const Vec3> points, int dropped) {
  const int i = (dropped + 1) % 3;
  const int j = (dropped + 2) % 3;
  Polygon order(points.size());
  for (Index k = 0; k < order.size(); ++k) order[k] = k;
  std::sort(order.begin(), order.end(), [&](Index a, Index b) {
    return points[a][i] != points[b][i] ? points[a][i] < points[b][i] : points[a][j] < points[b][j];
  });
  Polygon chain;
  const auto append = [&](Index next, std::size_t keep) {
    while (chain.size() >= keep + 2 && turn(points[chain[chain.size() - 2]], points[chain.back()],
                                            points[next], dropped) <= 0) {
      chain.pop_back();
    }
    chain.push_back(next);
  };
  for (const Index next : order) append(next, 0);
  const std::size_t lower = chain.size() - 1;
  for (std::size_t k = order.size() - 1; k-- > 0;) append(order[k], lower);
  chain.pop_back();  // the first point came again
  return chain;
}

/// The coordinate along which the plane of three points off one line is not seen edge-on.
int facingAxis(const Vec3& a, const Vec3& b, const Vec3& c) {
  for (int axis = 0; axis < 2; ++axis) {
    if (turn(a, b, c, axis) != 0) return axis;
  }
  return 2;
}

/// A closed surface of triangles over points, grown by step 3.
class TriangleHull {
 public:
  explicit TriangleHull(std::span<const Vec3> points) : points_(points) {}

  /// `base` is convex and anticlockwise seen from `apex`'s far side.
  void startPyramid(const Polygon& base, Index apex) {
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
    collectSeen(point);
    coneAtBorder(point);
  }

  std::vector<Polygon> mergedFaces();

 private:
  struct Triangle {
    std::array<Index, 3> corner;
    std::array<Index, 3> beyond;  ///< the triangle across the edge corner[i], corner[i + 1]
    bool alive = true;
    bool seen = false;
  };
  struct BorderEdge {
    Index from, to;
    Index beyond;  ///< the unseen triangle
  };

  bool sees(Index point, const Triangle& t) const {
    return orientation(points_[t.corner[0]], points_[t.corner[1]], points_[t.corner[2]],
                       points_[point]) > 0;
  }

  void collectSeen(Index point);
  void coneAtBorder(Index point);
  static Index cornerAway(const Triangle& t, Index beyond);
  std::vector<Index> planeOfTriangles() const;

  std::span<const Vec3> points_;
  std::vector<Triangle> triangles_;
  std::vector<Index> lastFan_;  ///< the triangles at the point inserted last
  std::vector<Index> seen_;
  std::vector<BorderEdge> border_;
  std::vector<Index> fanAt_ = std::vector<Index>(points_.size());  ///< by its `from` point
};

void TriangleHull::collectSeen(Index point) {
  seen_.clear();
  border_.clear();
  for (const Index t : lastFan_) {
    if (!sees(point, triangles_[t])) continue;
    triangles_[t].seen = true;
    seen_.push_back(t);
    break;
  }
  if (seen_.empty()) throw std::logic_error("buildHull: a point outside sees no face");
  for (std::size_t next = 0; next < seen_.size(); ++next) {
    const Triangle t = triangles_[seen_[next]];
    for (std::size_t e = 0; e < 3; ++e) {
      Triangle& other = triangles_[t.beyond[e]];
      if (other.seen) continue;
      if (sees(point, other)) {
        other.seen = true;
        seen_.push_back(t.beyond[e]);
      } else {
        border_.push_back({t.corner[e], t.corner[(e + 1) % 3], t.beyond[e]});
      }
    }
  }
}

void TriangleHull::coneAtBorder(Index point) {
  for (const Index t : seen_) triangles_[t].alive = false;
  lastFan_.clear();
  for (const BorderEdge& edge : border_) {
    const Index self = static_cast<Index>(triangles_.size());
    fanAt_[edge.from] = self;
    triangles_.push_back({{edge.from, edge.to, point}, {edge.beyond, 0, 0}});
    lastFan_.push_back(self);
    Triangle& beyond = triangles_[edge.beyond];
    for (std::size_t e = 0; e < 3; ++e) {
      if (beyond.corner[e] == edge.to && beyond.corner[(e + 1) % 3] == edge.from) {
        beyond.beyond[e] = self;
      }
    }
  }
  for (const Index t : lastFan_) {
    const Index next = fanAt_[triangles_[t].corner[1]];
    triangles_[t].beyond[1] = next;
    triangles_[next].beyond[2] = t;
  }
}

/// The corner of `t` that is none of its neighbour `beyond`.
Index TriangleHull::cornerAway(const Triangle& t, Index beyond) {
  const std::size_t edge = t.beyond[0] == beyond ? 0 : t.beyond[1] == beyond ? 1 : 2;
  return t.corner[(edge + 2) % 3];
}

/// For each triangle the first triangle of its plane; its own index for the first.
std::vector<Index> TriangleHull::planeOfTriangles() const {
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
      for (const Index other : t.beyond) {
        if (plane[other] != kNone) continue;
        const Index apex = cornerAway(triangles_[other], inPlane);
        if (orientation(points_[t.corner[0]], points_[t.corner[1]], points_[t.corner[2]],
                        points_[apex]) != 0)
          continue;
        plane[other] = first;
        open.push_back(other);
      }
    }
  }
  return plane;
}

std::vector<Polygon> TriangleHull::mergedFaces() {
  const std::vector<Index> plane = planeOfTriangles();
  struct HalfEdge {
    Index plane, from, to;
    auto operator<=>(const HalfEdge&) const = default;
  };
  std::vector<HalfEdge> edges;
  std::vector<Index> planesAt(points_.size(), 0);  // outgoing border edges: one a plane
  for (Index t = 0; t < triangles_.size(); ++t) {
    if (!triangles_[t].alive) continue;
    for (std::size_t e = 0; e < 3; ++e) {
      if (plane[triangles_[t].beyond[e]] == plane[t]) continue;
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
    faces.push_back(std::move(face));
    first = last;
  }
  return faces;
}

std::vector<Polygon> facesAround(std::span<const Vec3> points) {
  const std::size_t count = points.size();
  std::size_t offLine = 2;
  while (offLine < count && collinear(points[0], points[1], points[offLine])) ++offLine;
  if (offLine >= count) return {};
  std::size_t offPlane = offLine + 1;
  while (offPlane < count &&
         orientation(points[0], points[1], points[offLine], points[offPlane]) == 0) {
    ++offPlane;
  }
  Polygon base = polygonAround(points.first(std::min(offPlane, count)),
                               facingAxis(points[0], points[1], points[offLine]));
  if (offPlane >= count) return {base, Polygon(base.rbegin(), base.rend())};
  if (orientation(points[base[0]], points[base[1]], points[base[2]], points[offPlane]) > 0) {
    std::reverse(base.begin(), base.end());
  }
  TriangleHull hull(points);
  hull.startPyramid(base, static_cast<Index>(offPlane));
  for (std::size_t p = offPlane + 1; p < count; ++p) hull.insert(static_cast<Index>(p));
  return hull.mergedFaces();
}

/// Closed faces run along each of their edges once in each direction.
void linkNeighbours(Hull& hull) {
  const auto eachEdge = [&](const auto& visit) {
    for (const Polygon& face : hull.faces)
      for (std::size_t k = 0; k < face.size(); ++k) visit(face[k], face[(k + 1) % face.size()]);
    if (hull.faces.empty() && hull.vertices.size() == 2) {
      visit(0, 1);
      visit(1, 0);
    }
  };
  std::vector<Index>& start = hull.neighbourStart;
  start.assign(hull.vertices.size() + 1, 0);
  eachEdge([&](Index from, Index) { ++start[from + 1]; });
  for (std::size_t v = 1; v < start.size(); ++v) start[v] += start[v - 1];
  hull.neighbours.resize(start.back());
  std::vector<Index> next(start.begin(), start.end() - 1);
  eachEdge([&](Index from, Index to) { hull.neighbours[next[from]++] = to; });
  for (std::size_t v = 0; v + 1 < start.size(); ++v)
    std::sort(hull.neighbours.begin() + start[v], hull.neighbours.begin() + start[v + 1]);
}

/// Keeps the points that are corners of faces, in their order, and renumbers the faces.
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

/// Scaled, so that squares neither over- nor underflow.
double greatestNorm(std::span<const Vec3> points) {
  double largest = 0, greatest = 0;
  for (const Vec3& p : points) largest = std::max(largest, p.cwiseAbs().maxCoeff());
  if (largest == 0) return 0;
  for (const Vec3& p : points) {
    const double x = p.x() / largest, y = p.y() / largest, z = p.z() / largest;
    greatest = std::max(greatest, std::sqrt(x * x + y * y + z * z));
  }
  return greatest * largest;
}

// ---- validate ----------------------------------------------------------------------------------

[[noreturn]] void broken(const std::string& what) {
  throw std::logic_error("hull: " + what);
}

void validateEdges(const Hull& hull) {
  std::set<std::pair<Index, Index>> edges;
  for (std::size_t f = 0; f < hull.faces.size(); ++f) {
    const Polygon& face = hull.faces[f];
    if (face.size() < 3) broken("face " + std::to_string(f) + " has fewer than 3 corners");
    for (std::size_t k = 0; k < face.size(); ++k) {
      if (face[k] >= hull.vertices.size()) {
        broken("face " + std::to_string(f) + " names a vertex that is not there");
      }
      if (!edges.emplace(face[k], face[(k + 1) % face.size()]).second) {
        broken("face " + std::to_string(f) + " runs along an edge in the sense of another");
      }
    }
  }
  for (const auto& [from, to] : edges) {
    if (!edges.contains({to, from})) {
      broken("edge " + std::to_string(from) + "-" + std::to_string(to) + " has one face only");
    }
  }
  const std::size_t edgeCount = edges.size() / 2;
  const std::size_t euler = hull.faces.empty() ? 0 : 2;
  if (euler == 2 && hull.vertices.size() + hull.faces.size() != edgeCount + euler) {
    broken("Euler's formula fails: " + std::to_string(hull.vertices.size()) + " vertices, " +
           std::to_string(edgeCount) + " edges, " + std::to_string(hull.faces.size()) + " faces");
  }
}

void validateNeighbours(const Hull& hull) {
  Hull expected;
  expected.vertices = hull.vertices;
  expected.faces = hull.faces;
  linkNeighbours(expected);
  if (expected.neighbourStart != hull.neighbourStart || expected.neighbours != hull.neighbours) {
    broken("the neighbours are not those that the edges of the faces join");
  }
}

/// Corners turn one way, strictly, about the face's plane.
void validatePolygon(const Hull& hull, std::size_t f) {
  const Polygon& face = hull.faces[f];
  const auto at = [&](std::size_t k) -> const Vec3& {
    return hull.vertices[face[k % face.size()]];
  };
  const int axis = facingAxis(at(0), at(1), at(2));
  const int sense = turn(at(0), at(1), at(2), axis);
  for (std::size_t k = 0; k < face.size(); ++k) {
    if (sense == 0 || turn(at(k), at(k + 1), at(k + 2), axis) != sense) {
      broken("face " + std::to_string(f) + " is not strictly convex");
    }
  }
}

void validateSide(const Hull& hull, std::size_t f) {
  const Polygon& face = hull.faces[f];
  for (Index v = 0; v < hull.vertices.size(); ++v) {
    const int side = orientation(hull.vertices[face[0]], hull.vertices[face[1]],
                                 hull.vertices[face[2]], hull.vertices[v]);
    const bool corner = std::find(face.begin(), face.end(), v) != face.end();
    if (side > 0 || (side == 0) != corner) {
      broken("vertex " + std::to_string(v) + " is " + (side > 0 ? "outside" : "in the plane") +
             " of face " + std::to_string(f));
    }
  }
}

}  // namespace

Hull buildHull(std::span<const Vec3> points) {
  const std::vector<Vec3> sorted = sortedUnique(points);
  Hull hull;
  std::vector<Polygon> faces = facesAround(sorted);
  if (faces.empty()) {
    hull.vertices.push_back(sorted.front());
    if (sorted.size() > 1) hull.vertices.push_back(sorted.back());
  } else {
    keepCorners(hull, sorted, std::move(faces));
  }
  linkNeighbours(hull);
  hull.radius = greatestNorm(hull.vertices);
#ifndef NDEBUG
  validate(hull);
#endif
  return hull;
}

void validate(const Hull& hull) {
  if (hull.vertices.empty()) broken("no vertices");
  if (hull.faces.size() == 1 || hull.faces.size() == 3) broken("1 or 3 faces close nothing");
  if (hull.faces.empty() && hull.vertices.size() > 2) broken("3 or more vertices without faces");
  validateEdges(hull);
  validateNeighbours(hull);
  for (std::size_t f = 0; f < hull.faces.size(); ++f) {
    validatePolygon(hull, f);
    validateSide(hull, f);
  }
  if (hull.radius != greatestNorm(hull.vertices)) broken("the radius is not that of the vertices");
}

}  // namespace enfilade::collision
