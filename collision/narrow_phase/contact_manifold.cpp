// Steps (E. Catto, "Contact Manifolds", Game Developers Conference 2007)
//  1. Find the supporting outline of each body. Take the faces at its support vertex along the
//     normal and choose the one whose normal is closest to it. Keep the corners of that face within
//     `limit` of the support plane: a polygon, an edge or a vertex. A body of at most three
//     vertices uses all of them instead.
//  2. Project both outlines along the normal and clip one against the other. Clip polygons by
//     Sutherland and Hodgman, an edge by a polygon (Cyrus and Beck), two edges by their
//     intersection or overlap. A vertex stays a vertex.
//  3. Project each corner of the clipped outline along the normal onto the other outline. That
//     gives the other point and the separation. Drop points farther than `limit`.
//  4. If there are too many points, keep the deepest, then repeatedly the one farthest from all
//     kept.
// Departures: the outlines are cut by depth first, so that a leaning box has two points instead of
// four with two in the air. If the projections do not overlap, by rounding or because the outline
// is not a face, the manifold is the input's own pair of points.
//
// Tolerance: depths along the normal are accurate to kRounding times S, the maximum coordinate.
// Corners within that plus `limit` of the support plane count as on it. The tolerance is the
// rounding of the sums here, not a length.
#include "collision/narrow_phase/contact_manifold.hpp"

#include <algorithm>
#include <cmath>

#include "collision/assert.hpp"
#include "collision/shapes/hull.hpp"

namespace enfilade::collision {
namespace {

constexpr double kRounding = 64 * 0x1p-53;       // see the file head
constexpr std::size_t kMaxOutlineCorners = 128;  // of an outline; further corners are dropped

/// A frame whose third axis is the normal; x and y are the projection, z the depth.
struct ContactFrame {
  Vec3 origin, x, y, normal;

  ContactFrame(const Vec3& position, const Vec3& direction) : origin(position), normal(direction) {
    int smallestAxis = 0;
    normal.cwiseAbs().minCoeff(&smallestAxis);
    x = normal.cross(Vec3::Unit(smallestAxis)).normalized();
    y = normal.cross(x);
  }
  Vec3 toFrame(const Vec3& world) const {
    const Vec3 p = world - origin;
    return {p.dot(x), p.dot(y), p.dot(normal)};
  }
  Vec3 toWorld(const Vec3& p) const { return origin + p.x() * x + p.y() * y + p.z() * normal; }
};

/// Corners in the contact frame, in order around the outline.
struct Outline {
  std::array<Vec3, kMaxOutlineCorners> corners;
  std::size_t size = 0;

  Outline() = default;
  Outline(const Outline& other) : size(other.size) {
    std::copy_n(other.corners.begin(), size, corners.begin());
  }
  Outline& operator=(const Outline& other) {
    size = other.size;
    std::copy_n(other.corners.begin(), size, corners.begin());
    return *this;
  }
  void add(const Vec3& corner) {
    if (size < kMaxOutlineCorners) corners[size++] = corner;
  }
  const Vec3& next(std::size_t i) const { return corners[i + 1 == size ? 0 : i + 1]; }
};

// ---- step 1 ------------------------------------------------------------------------------------

/// A placed convex, projected along the contact normal.
struct ProjectedConvex {
  const PlacedConvex& body;
  std::span<const Vec3> normals;  ///< of its faces, unit, body's frame; or empty
  Vec3 x, y, z;                   ///< the contact frame's axes in the body's frame
  Vec3 origin;                    ///< the body's origin in the contact frame
  Vec3 outward;                   ///< towards the other body, body's frame

  /// `sense` 1: along the normal (A), -1: against it (B).
  ProjectedConvex(const PlacedConvex& b, const ContactFrame& frame, std::span<const Vec3> n,
                  double sense)
      : body(b), normals(n), x(frame.x), y(frame.y), z(frame.normal) {
    if (b.rotation) {
      const auto bodyFromWorld = b.rotation->transpose();
      x = bodyFromWorld * x, y = bodyFromWorld * y, z = bodyFromWorld * z;
    }
    origin = frame.toFrame(b.translation);
    outward = sense * z;
  }
  Vec3 corner(std::uint32_t i) const {
    const Vec3& v = body.vertices[i];
    return {v.dot(x) + origin.x(), v.dot(y) + origin.y(), v.dot(z) + origin.z()};
  }
};

std::uint32_t findSupportVertex(const ProjectedConvex& projected) {
  std::uint32_t best = 0;
  double maxProjection = -std::numeric_limits<double>::infinity();
  for (std::uint32_t i = 0; i < projected.body.vertices.size(); ++i) {
    const double projection = projected.outward.dot(projected.body.vertices[i]);
    best = projection > maxProjection ? i : best;
    maxProjection = std::max(maxProjection, projection);
  }
  return best;
}

/// Newell's normal of a face, unit, body's frame.
Vec3 computeFaceNormal(const PlacedConvex& convex, const std::vector<std::uint32_t>& face) {
  const Vec3& first = convex.vertices[face[0]];
  Vec3 normal = Vec3::Zero();
  for (std::size_t i = 1; i + 1 < face.size(); ++i)
    normal += (convex.vertices[face[i]] - first).cross(convex.vertices[face[i + 1]] - first);
  return normal / normal.norm();
}

bool hasVertex(const std::vector<std::uint32_t>& face, std::uint32_t vertex) {
  return std::find(face.begin(), face.end(), vertex) != face.end();
}

/// Finds the face whose known normal points most towards the other body.
std::size_t findMostFacing(const ProjectedConvex& projected) {
  std::size_t best = 0;
  double maxProjection = -std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < projected.normals.size(); ++i) {
    const double projection = projected.outward.dot(projected.normals[i]);
    best = projection > maxProjection ? i : best;  // branchless: avoids mispredictions
    maxProjection = std::max(maxProjection, projection);
  }
  return best;
}

/// Finds the face at `vertex` that faces the other body most.
const std::vector<std::uint32_t>* findSupportFace(const ProjectedConvex& projected,
                                                  std::uint32_t vertex) {
  const auto& faces = projected.body.hull->faces;
  const bool known = projected.normals.size() == faces.size();
  if (known) {  // the most facing face usually has the vertex
    const auto& face = faces[findMostFacing(projected)];
    if (hasVertex(face, vertex)) return &face;
  }
  const std::vector<std::uint32_t>* best = nullptr;
  double maxProjection = -std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < faces.size(); ++i) {
    if (!hasVertex(faces[i], vertex)) continue;
    const Vec3 normal = known ? projected.normals[i] : computeFaceNormal(projected.body, faces[i]);
    const double projection = projected.outward.dot(normal);
    if (projection > maxProjection) maxProjection = projection, best = &faces[i];
  }
  return best;
}

/// Builds the supporting outline: corners up to `slack` metres below the support plane.
Outline buildSupportOutline(const ProjectedConvex& projected, double sense, double slack) {
  const PlacedConvex& convex = projected.body;
  const std::uint32_t vertex = findSupportVertex(projected);
  const Vec3 support = projected.corner(vertex);
  Outline outline;
  const auto addCorner = [&](std::uint32_t i) {
    const Vec3 corner = i == vertex ? support : projected.corner(i);
    if (sense * corner.z() >= sense * support.z() - slack) outline.add(corner);
  };
  const auto* face =
      convex.hull && !convex.hull->faces.empty() ? findSupportFace(projected, vertex) : nullptr;
  if (face) {
    for (const std::uint32_t i : *face) addCorner(i);
  } else if (convex.vertices.size() <= 3) {
    for (std::uint32_t i = 0; i < convex.vertices.size(); ++i) addCorner(i);
  }
  if (outline.size == 0) outline.add(support);
  return outline;
}

// ---- step 2, in the projection -----------------------------------------------------------------

double cross(const Vec3& a, const Vec3& b) {
  return a.x() * b.y() - a.y() * b.x();
}

double dot(const Vec3& a, const Vec3& b) {
  return a.x() * b.x() + a.y() * b.y();
}

double computeTwiceArea(const Outline& polygon) {
  double twice = 0;
  for (std::size_t i = 1; i + 1 < polygon.size; ++i)
    twice +=
        cross(polygon.corners[i] - polygon.corners[0], polygon.corners[i + 1] - polygon.corners[0]);
  return twice;
}

/// Clips `subject` to the left side of the edge `begin`-`end`, edge included.
Outline clipByEdge(const Outline& subject, const Vec3& begin, const Vec3& end, double rounding) {
  Outline clipped;
  const Vec3 edge = end - begin;
  const double slack = rounding * std::sqrt(dot(edge, edge));
  const auto left = [&](const Vec3& p) { return cross(edge, p - begin) + slack; };
  double side = subject.size > 0 ? left(subject.corners[0]) : 0;
  const double firstSide = side;
  for (std::size_t i = 0; i < subject.size; ++i) {
    const Vec3 &here = subject.corners[i], &next = subject.next(i);
    const double nextSide = i + 1 == subject.size ? firstSide : left(next);
    if (side >= 0) clipped.add(here);
    const bool last = subject.size == 2 && i == 1;  // a segment is not closed
    if (!last && (side >= 0) != (nextSide >= 0))
      clipped.add(here + side / (side - nextSide) * (next - here));
    side = nextSide;
  }
  return clipped;
}

/// `polygon` has three corners or more, anticlockwise.
Outline clipByPolygon(Outline subject, const Outline& polygon, double rounding) {
  for (std::size_t i = 0; i < polygon.size && subject.size > 0; ++i)
    subject = clipByEdge(subject, polygon.corners[i], polygon.next(i), rounding);
  return subject;
}

/// The part of edge `a` above edge `b`: empty, a point, or the overlap of parallel edges.
Outline intersectEdges(const Outline& a, const Outline& b, double rounding) {
  const Vec3 alongA = a.corners[1] - a.corners[0], alongB = b.corners[1] - b.corners[0];
  const Vec3 between = b.corners[0] - a.corners[0];
  const double spanned = cross(alongA, alongB);
  const double lengthA = std::sqrt(dot(alongA, alongA)), lengthB = std::sqrt(dot(alongB, alongB));
  Outline overlap;
  if (std::abs(spanned) > rounding * (lengthA + lengthB)) {
    const double s = cross(between, alongB) / spanned, t = cross(between, alongA) / spanned;
    if (s >= 0 && s <= 1 && t >= 0 && t <= 1) overlap.add(a.corners[0] + s * alongA);
    return overlap;
  }
  const double squared = dot(alongA, alongA);
  if (!(squared > 0)) return overlap;
  const double first = dot(between, alongA) / squared;
  const double second = first + dot(alongB, alongA) / squared;
  const double low = std::max(0.0, std::min(first, second));
  const double high = std::min(1.0, std::max(first, second));
  if (low > high) return overlap;
  overlap.add(a.corners[0] + low * alongA);
  if (high > low) overlap.add(a.corners[0] + high * alongA);
  return overlap;
}

/// Clips `subject` against `other` in the projection along the normal.
Outline clipOutline(const Outline& subject, Outline other, double rounding) {
  if (subject.size == 1 || other.size == 1) return subject.size == 1 ? subject : Outline{};
  if (other.size == 2)
    return subject.size == 2 ? intersectEdges(subject, other, rounding) : Outline{};
  if (computeTwiceArea(other) < 0)
    std::reverse(other.corners.begin(), other.corners.begin() + other.size);
  return clipByPolygon(subject, other, rounding);
}

// ---- step 3 ------------------------------------------------------------------------------------

/// Interpolates the depth of an outline at points of the projection.
class DepthInterpolator {
 public:
  explicit DepthInterpolator(const Outline& outline)
      : size_(outline.size), first_(outline.corners[0]) {
    for (std::size_t i = 0; i < size_; ++i) {
      minDepth_ = std::min(minDepth_, outline.corners[i].z());
      maxDepth_ = std::max(maxDepth_, outline.corners[i].z());
    }
    if (size_ == 2) normal_ = outline.corners[1] - first_;
    for (std::size_t i = 1; i + 1 < size_; ++i)
      normal_ += (outline.corners[i] - first_).cross(outline.corners[i + 1] - first_);
  }
  double computeDepthAt(const Vec3& point) const {
    const Vec3 away = point - first_;
    double depth = first_.z();
    if (size_ == 2) {
      const double squared = dot(normal_, normal_);
      if (squared > 0) depth += dot(away, normal_) / squared * normal_.z();
    } else if (size_ > 2 && normal_.z() != 0) {
      depth -= dot(away, normal_) / normal_.z();
    }
    return std::clamp(depth, minDepth_, maxDepth_);  // never extrapolates beyond the corners
  }

 private:
  std::size_t size_;
  Vec3 first_;
  Vec3 normal_ = Vec3::Zero();  ///< of the plane, any length; for an edge, its direction
  double minDepth_ = std::numeric_limits<double>::infinity();
  double maxDepth_ = -std::numeric_limits<double>::infinity();
};

// ---- step 4 ------------------------------------------------------------------------------------

constexpr double kInfiniteSpread = std::numeric_limits<double>::infinity();

/// A candidate point. Uninitialised, because most array entries are never written.
struct Candidate {
  Vec3 pointA, pointB;
  double separation;
  double spread;  ///< squared distance from the nearest kept point
};

void keepMostSpread(std::span<Candidate> points, std::size_t maxPoints, ContactManifold& manifold) {
  if (points.empty()) return;
  const auto keep = [&](const Candidate& kept) {
    manifold.points[manifold.size++] = {kept.pointA, kept.pointB, kept.separation};
    for (Candidate& point : points)
      point.spread = std::min(point.spread, (kept.pointA - point.pointA).squaredNorm());
  };
  keep(*std::ranges::min_element(points, {}, &Candidate::separation));
  while (manifold.size < std::min(maxPoints, ContactManifold::kMaxPoints)) {
    const Candidate& farthest = *std::ranges::max_element(points, {}, &Candidate::spread);
    if (!(farthest.spread > 0)) return;
    keep(farthest);
  }
}

/// Approximate upper bound on the maximum |coordinate| of the corners relative to `origin`.
double computeExtent(const PlacedConvex& convex, const Vec3& origin) {
  if (convex.hull) return convex.hull->radius + (convex.translation - origin).cwiseAbs().maxCoeff();
  double size = 0;
  for (std::uint32_t i = 0; i < convex.vertices.size(); ++i)
    size = std::max(size, (placeVertex(convex, convex.vertices[i]) - origin).cwiseAbs().maxCoeff());
  return size;
}

}  // namespace

ContactManifold computeContactManifold(const PlacedConvex& a, const PlacedConvex& b,
                                       const ManifoldInput& input) {
  ENFILADE_ASSERT(std::abs(input.normal.squaredNorm() - 1) < 1e-6 && input.maxPoints >= 1);
  ContactManifold manifold;
  manifold.normal = input.normal;
  const ContactFrame frame(input.pointA, input.normal);
  const double rounding =
      kRounding * (computeExtent(a, frame.origin) + computeExtent(b, frame.origin) +
                   a.translation.cwiseAbs().maxCoeff() + b.translation.cwiseAbs().maxCoeff());
  const double nearest = frame.toFrame(input.pointB).z();
  if (nearest > input.limit + rounding) return manifold;

  const double slack = input.limit - nearest + 2 * rounding;
  const Outline onA = buildSupportOutline({a, frame, input.normalsA, 1}, 1, slack);
  const Outline onB = buildSupportOutline({b, frame, input.normalsB, -1}, -1, slack);
  const bool fromA = onA.size == 1 || (onB.size > 1 && (onA.size == 2 || onB.size > 2));
  const Outline overlap = fromA ? clipOutline(onA, onB, rounding) : clipOutline(onB, onA, rounding);

  ENFILADE_ASSERT(onA.size > 0 && onB.size > 0);
  const DepthInterpolator depths(fromA ? onB : onA);
  std::array<Candidate, kMaxOutlineCorners> points;
  std::size_t count = 0;
  for (std::size_t i = 0; i < overlap.size; ++i) {
    Vec3 pointA = overlap.corners[i], pointB = pointA;
    (fromA ? pointB : pointA).z() = depths.computeDepthAt(overlap.corners[i]);
    const double separation = pointB.z() - pointA.z();
    if (separation <= input.limit + 2 * rounding)
      points[count++] = {frame.toWorld(pointA), frame.toWorld(pointB), separation, kInfiniteSpread};
  }
  manifold.overlap = count > 0;
  if (count == 0) points[count++] = {input.pointA, input.pointB, nearest, kInfiniteSpread};
  keepMostSpread({points.data(), count}, input.maxPoints, manifold);
  ENFILADE_ASSERT(manifold.size >= 1 && manifold.size <= ContactManifold::kMaxPoints);
  return manifold;
}

}  // namespace enfilade::collision
