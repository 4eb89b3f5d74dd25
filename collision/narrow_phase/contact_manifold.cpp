// Steps (E. Catto, "Contact Manifolds", Game Developers Conference 2007)
//  1. The outline that supports a body: of the faces at its vertex farthest along the normal the
//  one
//     that faces along it most; of that face the corners that lie within `limit` of the support
//     plane: a polygon, an edge, or a vertex. (Of a body of three vertices at most: of them.)
//  2. Both outlines are projected along the normal and clipped against one another: polygons by
//     Sutherland and Hodgman, an edge by a polygon (Cyrus and Beck), two edges by where they cross
//     or overlap. A vertex stays a vertex.
//  3. Where a corner of the clipped outline meets the other one along the normal, that is the other
//     point, and the way between them the separation. Points farther than `limit` go.
//  4. Of too many points, the deepest stays, and then again and again the one that is farthest from
//     all that stay.
// Departures: the outlines are cut by depth first, so that a leaning box has two points, and not
// four of which two hang in the air; where the projections miss one another (they may, by rounding,
// or where the outline is no face), the seed's own points are the manifold.
//
// Tolerance: depths along the normal are known to kRounding u S, S the greatest coordinate; corners
// within that and `limit` of the support plane lie in it. It is the rounding of the sums here, not
// a length.
#include "collision/narrow_phase/contact_manifold.hpp"

#include <algorithm>
#include <cmath>

#include "collision/shapes/hull.hpp"

namespace enfilade::collision {
namespace {

constexpr double kRounding = 64 * 0x1p-53;  // see the file's head
constexpr std::size_t kMostCorners = 128;  // of an outline, and of a clipped one; more are left out

/// A frame whose third axis is the normal; x and y are the projection, z the depth.
struct ContactFrame {
  Vec3 origin, x, y, normal;

  ContactFrame(const Vec3& at, const Vec3& along) : origin(at), normal(along) {
    int least = 0;
    normal.cwiseAbs().minCoeff(&least);
    x = normal.cross(Vec3::Unit(least)).normalized();
    y = normal.cross(x);
  }
  Vec3 inFrame(const Vec3& world) const {
    const Vec3 p = world - origin;
    return {p.dot(x), p.dot(y), p.dot(normal)};
  }
  Vec3 inWorld(const Vec3& p) const { return origin + p.x() * x + p.y() * y + p.z() * normal; }
};

/// Corners in the contact's frame, in order around.
struct Outline {
  std::array<Vec3, kMostCorners> corners;
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
    if (size < kMostCorners) corners[size++] = corner;
  }
  const Vec3& next(std::size_t i) const { return corners[i + 1 == size ? 0 : i + 1]; }
};

// ---- step 1 ------------------------------------------------------------------------------------

Vec3 worldVertex(const ConvexBody& body, std::uint32_t i) {
  const Vec3& v = body.vertices[i];
  return (body.rotation ? Vec3(*body.rotation * v) : v) + body.translation;
}

/// A body, seen along the contact's normal.
struct Seen {
  const ConvexBody& body;
  std::span<const Vec3> normals;  ///< of its faces, unit, body's frame; or none
  Vec3 x, y, z;                   ///< the contact's axes in the body's frame
  Vec3 at;                        ///< the body's origin in the contact's frame
  Vec3 outwards;                  ///< towards the other body, body's frame

  /// `sense` 1: along the normal (A), -1: against it (B).
  Seen(const ConvexBody& b, const ContactFrame& frame, std::span<const Vec3> n, double sense)
      : body(b), normals(n), x(frame.x), y(frame.y), z(frame.normal) {
    if (b.rotation) {
      const auto bodyFromWorld = b.rotation->transpose();
      x = bodyFromWorld * x, y = bodyFromWorld * y, z = bodyFromWorld * z;
    }
    at = frame.inFrame(b.translation);
    outwards = sense * z;
  }
  Vec3 corner(std::uint32_t i) const {
    const Vec3& v = body.vertices[i];
    return {v.dot(x) + at.x(), v.dot(y) + at.y(), v.dot(z) + at.z()};
  }
};

std::uint32_t supportVertex(const Seen& seen) {
  std::uint32_t best = 0;
  double most = -std::numeric_limits<double>::infinity();
  for (std::uint32_t i = 0; i < seen.body.vertices.size(); ++i) {
    const double along = seen.outwards.dot(seen.body.vertices[i]);
    best = along > most ? i : best;
    most = std::max(most, along);
  }
  return best;
}

/// Newell's normal of a face, unit, body's frame.
Vec3 normalOfFace(const ConvexBody& body, const std::vector<std::uint32_t>& face) {
  const Vec3& first = body.vertices[face[0]];
  Vec3 normal = Vec3::Zero();
  for (std::size_t i = 1; i + 1 < face.size(); ++i)
    normal += (body.vertices[face[i]] - first).cross(body.vertices[face[i + 1]] - first);
  return normal / normal.norm();
}

bool hasVertex(const std::vector<std::uint32_t>& face, std::uint32_t vertex) {
  return std::find(face.begin(), face.end(), vertex) != face.end();
}

/// Of all faces, by their known normals, the one that faces the other body most.
std::size_t mostFacing(const Seen& seen) {
  std::size_t best = 0;
  double most = -std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < seen.normals.size(); ++i) {
    const double along = seen.outwards.dot(seen.normals[i]);
    best = along > most ? i : best;  // no branch: no guess of it to miss
    most = std::max(most, along);
  }
  return best;
}

/// The face at `vertex` that faces the other body most.
const std::vector<std::uint32_t>* supportFace(const Seen& seen, std::uint32_t vertex) {
  const auto& faces = seen.body.hull->faces;
  const bool known = seen.normals.size() == faces.size();
  if (known) {  // nearly always it is that of all faces
    const auto& face = faces[mostFacing(seen)];
    if (hasVertex(face, vertex)) return &face;
  }
  const std::vector<std::uint32_t>* best = nullptr;
  double most = -std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < faces.size(); ++i) {
    if (!hasVertex(faces[i], vertex)) continue;
    const Vec3 normal = known ? seen.normals[i] : normalOfFace(seen.body, faces[i]);
    const double along = seen.outwards.dot(normal);
    if (along > most) most = along, best = &faces[i];
  }
  return best;
}

/// `slack`: metres below the support plane.
Outline supportOutline(const Seen& seen, double sense, double slack) {
  const ConvexBody& body = seen.body;
  const std::uint32_t vertex = supportVertex(seen);
  const Vec3 summit = seen.corner(vertex);
  Outline outline;
  const auto take = [&](std::uint32_t i) {
    const Vec3 corner = i == vertex ? summit : seen.corner(i);
    if (sense * corner.z() >= sense * summit.z() - slack) outline.add(corner);
  };
  const auto* face = body.hull && !body.hull->faces.empty() ? supportFace(seen, vertex) : nullptr;
  if (face) {
    for (const std::uint32_t i : *face) take(i);
  } else if (body.vertices.size() <= 3) {
    for (std::uint32_t i = 0; i < body.vertices.size(); ++i) take(i);
  }
  if (outline.size == 0) outline.add(summit);
  return outline;
}

// ---- step 2, in the projection -----------------------------------------------------------------

double cross(const Vec3& a, const Vec3& b) {
  return a.x() * b.y() - a.y() * b.x();
}

double dot(const Vec3& a, const Vec3& b) {
  return a.x() * b.x() + a.y() * b.y();
}

double area(const Outline& polygon) {
  double twice = 0;
  for (std::size_t i = 1; i + 1 < polygon.size; ++i)
    twice +=
        cross(polygon.corners[i] - polygon.corners[0], polygon.corners[i + 1] - polygon.corners[0]);
  return twice;
}

/// What of `subject` lies left of the edge from `from` to `to`, or on it.
Outline clippedByEdge(const Outline& subject, const Vec3& from, const Vec3& to, double rounding) {
  Outline kept;
  const Vec3 edge = to - from;
  const double slack = rounding * std::sqrt(dot(edge, edge));
  const auto left = [&](const Vec3& p) { return cross(edge, p - from) + slack; };
  double at = subject.size > 0 ? left(subject.corners[0]) : 0;
  const double first = at;
  for (std::size_t i = 0; i < subject.size; ++i) {
    const Vec3 &here = subject.corners[i], &next = subject.next(i);
    const double after = i + 1 == subject.size ? first : left(next);
    if (at >= 0) kept.add(here);
    const bool last = subject.size == 2 && i == 1;  // a segment goes there, but not back
    if (!last && (at >= 0) != (after >= 0)) kept.add(here + at / (at - after) * (next - here));
    at = after;
  }
  return kept;
}

/// `polygon` has three corners or more, anticlockwise.
Outline clippedByPolygon(Outline subject, const Outline& polygon, double rounding) {
  for (std::size_t i = 0; i < polygon.size && subject.size > 0; ++i)
    subject = clippedByEdge(subject, polygon.corners[i], polygon.next(i), rounding);
  return subject;
}

/// What of edge `a` lies above edge `b`: nothing, a point, or where they run side by side.
Outline edgesMeeting(const Outline& a, const Outline& b, double rounding) {
  const Vec3 alongA = a.corners[1] - a.corners[0], alongB = b.corners[1] - b.corners[0];
  const Vec3 between = b.corners[0] - a.corners[0];
  const double spanned = cross(alongA, alongB);
  const double lengthA = std::sqrt(dot(alongA, alongA)), lengthB = std::sqrt(dot(alongB, alongB));
  Outline kept;
  if (std::abs(spanned) > rounding * (lengthA + lengthB)) {
    const double s = cross(between, alongB) / spanned, t = cross(between, alongA) / spanned;
    if (s >= 0 && s <= 1 && t >= 0 && t <= 1) kept.add(a.corners[0] + s * alongA);
    return kept;
  }
  const double squared = dot(alongA, alongA);
  if (!(squared > 0)) return kept;
  const double first = dot(between, alongA) / squared;
  const double second = first + dot(alongB, alongA) / squared;
  const double low = std::max(0.0, std::min(first, second));
  const double high = std::min(1.0, std::max(first, second));
  if (low > high) return kept;
  kept.add(a.corners[0] + low * alongA);
  if (high > low) kept.add(a.corners[0] + high * alongA);
  return kept;
}

/// The points of `subject` that lie above `other`, both seen along the normal.
Outline clipped(const Outline& subject, Outline other, double rounding) {
  if (subject.size == 1 || other.size == 1) return subject.size == 1 ? subject : Outline{};
  if (other.size == 2)
    return subject.size == 2 ? edgesMeeting(subject, other, rounding) : Outline{};
  if (area(other) < 0) std::reverse(other.corners.begin(), other.corners.begin() + other.size);
  return clippedByPolygon(subject, other, rounding);
}

// ---- step 3 ------------------------------------------------------------------------------------

/// The depth of an outline above or below points of the projection.
class Depths {
 public:
  explicit Depths(const Outline& outline) : size_(outline.size), first_(outline.corners[0]) {
    for (std::size_t i = 0; i < size_; ++i) {
      least_ = std::min(least_, outline.corners[i].z());
      most_ = std::max(most_, outline.corners[i].z());
    }
    if (size_ == 2) normal_ = outline.corners[1] - first_;
    for (std::size_t i = 1; i + 1 < size_; ++i)
      normal_ += (outline.corners[i] - first_).cross(outline.corners[i + 1] - first_);
  }
  double at(const Vec3& point) const {
    const Vec3 away = point - first_;
    double depth = first_.z();
    if (size_ == 2) {
      const double squared = dot(normal_, normal_);
      if (squared > 0) depth += dot(away, normal_) / squared * normal_.z();
    } else if (size_ > 2 && normal_.z() != 0) {
      depth -= dot(away, normal_) / normal_.z();
    }
    return std::clamp(depth, least_, most_);  // no plane is trusted beyond its corners
  }

 private:
  std::size_t size_;
  Vec3 first_;
  Vec3 normal_ = Vec3::Zero();  ///< of the plane, any length; of an edge: along it
  double least_ = std::numeric_limits<double>::infinity();
  double most_ = -std::numeric_limits<double>::infinity();
};

// ---- step 4 ------------------------------------------------------------------------------------

constexpr double kApart = std::numeric_limits<double>::infinity();

/// A point that may stay. (No initial values: most are never written.)
struct Candidate {
  Vec3 pointA, pointB;
  double separation;
  double spread;  ///< squared distance from the nearest that stays
};

void keepMostSpread(std::span<Candidate> points, std::size_t most, ContactManifold& manifold) {
  if (points.empty()) return;
  const auto keep = [&](const Candidate& kept) {
    manifold.points[manifold.size++] = {kept.pointA, kept.pointB, kept.separation};
    for (Candidate& point : points)
      point.spread = std::min(point.spread, (kept.pointA - point.pointA).squaredNorm());
  };
  keep(*std::ranges::min_element(points, {}, &Candidate::separation));
  while (manifold.size < std::min(most, ContactManifold::kMostPoints)) {
    const Candidate& farthest = *std::ranges::max_element(points, {}, &Candidate::spread);
    if (!(farthest.spread > 0)) return;
    keep(farthest);
  }
}

/// At least about the greatest coordinate of its corners, seen from `origin`.
double sizeOf(const ConvexBody& body, const Vec3& origin) {
  if (body.hull) return body.hull->radius + (body.translation - origin).cwiseAbs().maxCoeff();
  double size = 0;
  for (std::uint32_t i = 0; i < body.vertices.size(); ++i)
    size = std::max(size, (worldVertex(body, i) - origin).cwiseAbs().maxCoeff());
  return size;
}

}  // namespace

ContactManifold contactManifold(const ConvexBody& a, const ConvexBody& b, const ContactSeed& seed) {
  ContactManifold manifold;
  manifold.normal = seed.normal;
  const ContactFrame frame(seed.pointA, seed.normal);
  const double rounding =
      kRounding * (sizeOf(a, frame.origin) + sizeOf(b, frame.origin) +
                   a.translation.cwiseAbs().maxCoeff() + b.translation.cwiseAbs().maxCoeff());
  const double nearest = frame.inFrame(seed.pointB).z();
  if (nearest > seed.limit + rounding) return manifold;

  const double slack = seed.limit - nearest + 2 * rounding;
  const Outline onA = supportOutline({a, frame, seed.normalsA, 1}, 1, slack);
  const Outline onB = supportOutline({b, frame, seed.normalsB, -1}, -1, slack);
  const bool fromA = onA.size == 1 || (onB.size > 1 && (onA.size == 2 || onB.size > 2));
  const Outline overlap = fromA ? clipped(onA, onB, rounding) : clipped(onB, onA, rounding);

  const Depths depths(fromA ? onB : onA);
  std::array<Candidate, kMostCorners> points;
  std::size_t count = 0;
  for (std::size_t i = 0; i < overlap.size; ++i) {
    Vec3 pointA = overlap.corners[i], pointB = pointA;
    (fromA ? pointB : pointA).z() = depths.at(overlap.corners[i]);
    const double separation = pointB.z() - pointA.z();
    if (separation <= seed.limit + 2 * rounding)
      points[count++] = {frame.inWorld(pointA), frame.inWorld(pointB), separation, kApart};
  }
  manifold.overlap = count > 0;
  if (count == 0) points[count++] = {seed.pointA, seed.pointB, nearest, kApart};
  keepMostSpread({points.data(), count}, seed.most, manifold);
  return manifold;
}

}  // namespace enfilade::collision
