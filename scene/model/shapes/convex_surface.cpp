#include "scene/model/shapes/convex_surface.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "collision/shapes/exact_orientation.hpp"
#include "collision/shapes/hull.hpp"

namespace enfilade::scene {
namespace {

using Corners = std::array<std::uint32_t, 3>;

constexpr std::size_t kMostVertices = 1 << 16;    // of a surface whose hull is worth building
constexpr std::size_t kMostPlaneTests = 1 << 24;  // triangles times faces of one surface
constexpr std::size_t kSample = 64;               // triangles looked at before a hull is built

/// A surface by itself: its own vertices, in doubles.
struct Body {
  std::vector<Vec3> points;
  std::vector<Corners> triangles;
  Vec3 halfUnits = Vec3::Zero();  ///< of rounding, of the greatest coordinate on each axis
  double extent = 0;              ///< greatest side of the box
};

Body bodyOf(std::span<const Eigen::Vector3f> vertices, std::span<const Corners> triangles) {
  Body body;
  std::vector<std::uint32_t> used;
  for (const Corners& t : triangles) used.insert(used.end(), t.begin(), t.end());
  std::sort(used.begin(), used.end());
  used.erase(std::unique(used.begin(), used.end()), used.end());
  Box box;
  for (const std::uint32_t v : used) {
    body.points.push_back(vertices[v].cast<double>());
    box.include(body.points.back());
  }
  for (const Corners& t : triangles) {
    Corners own{};
    for (std::size_t k = 0; k < 3; ++k) {
      own[k] = static_cast<std::uint32_t>(std::lower_bound(used.begin(), used.end(), t[k]) -
                                          used.begin());
    }
    body.triangles.push_back(own);
  }
  body.halfUnits = 0x1p-24 * box.min.cwiseAbs().cwiseMax(box.max.cwiseAbs());
  body.extent = box.size().maxCoeff();
  return body;
}

double sixfoldVolume(const Body& body) {
  const Vec3& origin = body.points.front();
  double sum = 0;
  for (const Corners& t : body.triangles) {
    const Vec3 a = body.points[t[0]] - origin, b = body.points[t[1]] - origin,
               c = body.points[t[2]] - origin;
    sum += a.dot(b.cross(c));
  }
  return sum;
}

/// Some faces of most surfaces that are not convex have points well on both sides. What is told
/// here would fail the test in full: a triangle 1e5 d high whose corners lie within d of a face's
/// plane is tilted against it by so little that no point is beyond it by a thousandth of the
/// extent.
bool clearlyNotConvex(const Body& body) {
  const double clear = 1e-3 * body.extent;
  const double high = 6e5 * body.halfUnits.sum();
  const std::size_t stride = std::max<std::size_t>(1, body.triangles.size() / kSample);
  for (std::size_t i = 0; i < body.triangles.size(); i += stride) {
    const Corners& t = body.triangles[i];
    const Vec3 a = body.points[t[0]], ab = body.points[t[1]] - a, ac = body.points[t[2]] - a;
    const Vec3 normal = ab.cross(ac);
    const double area = normal.norm();
    const double longest = std::max({ab.norm(), ac.norm(), (ac - ab).norm()});
    if (!(area > high * longest)) continue;
    double lowest = 0, highest = 0;
    for (const Vec3& p : body.points) {
      const double height = normal.dot(p - a) / area;
      lowest = std::min(lowest, height);
      highest = std::max(highest, height);
    }
    if (lowest < -clear && highest > clear) return true;
  }
  return false;
}

/// A face of the hull: three of its corners, and its plane in doubles.
struct FacePlane {
  std::array<Vec3, 3> corners;
  Vec3 normal;      ///< unit, outwards
  double height;    ///< normal . x on the plane
  double rounding;  ///< d of the rule

  FacePlane(const collision::Hull& hull, const std::vector<std::uint32_t>& face,
            const Vec3& halfUnits)
      : corners{hull.vertices[face[0]], hull.vertices[face[1]], hull.vertices[face[2]]} {
    normal = Vec3::Zero();  // Newell's sum: steady where three corners lie nearly on a line
    for (std::size_t k = 1; k + 1 < face.size(); ++k) {
      normal += (hull.vertices[face[k]] - corners[0])
                    .cross(hull.vertices[face[k + 1]] - hull.vertices[face[k]]);
    }
    normal /= normal.norm();
    height = normal.dot(corners[0]);
    rounding = 6 * normal.cwiseAbs().dot(halfUnits);
  }

  bool near(const Vec3& p) const { return height - normal.dot(p) <= rounding; }
  bool holds(const Vec3& p) const {
    return near(p) && collision::orientation(corners[0], corners[1], corners[2], p) == 0;
  }
};

class HullOfBody {
 public:
  explicit HullOfBody(const Body& body)
      : body_(body), hull_(collision::buildHull(body.points)), at_(body.points.size()) {
    for (const auto& face : hull_.faces) planes_.emplace_back(hull_, face, body.halfUnits);
    linkFaces();
  }

  bool isSolid() const { return planes_.size() >= 4; }

  double sixfoldVolume() const {
    const Vec3& origin = hull_.vertices.front();
    double sum = 0;
    for (const auto& face : hull_.faces) {
      const Vec3 a = hull_.vertices[face[0]] - origin;
      for (std::size_t k = 1; k + 1 < face.size(); ++k) {
        const Vec3 b = hull_.vertices[face[k]] - origin, c = hull_.vertices[face[k + 1]] - origin;
        sum += a.dot(b.cross(c));
      }
    }
    return sum;
  }

  /// The first face found of which `holds(plane, corner)` is true for the triangle's corners.
  template <class Holds>
  const FacePlane* faceOf(const Corners& t, const Holds& holds) {
    const auto all = [&](const FacePlane& plane) {
      return holds(plane, body_.points[t[0]]) && holds(plane, body_.points[t[1]]) &&
             holds(plane, body_.points[t[2]]);
    };
    for (const std::uint32_t corner : t) {
      for (const std::uint32_t face : at_[corner]) {
        if (all(planes_[face])) return &planes_[face];
      }
    }
    // Its corners are none of the hull's, or its face begins elsewhere.
    for (const FacePlane& plane : planes_) {
      if (++scanned_ > kMostPlaneTests) return nullptr;
      if (all(plane)) return &plane;
    }
    return nullptr;
  }

  bool gaveUp() const { return scanned_ > kMostPlaneTests; }

  /// +1: the triangle, which lies in `plane`, looks out of the hull; -1: into it. Exact.
  int senseOf(const Corners& t, const FacePlane& plane) const {
    for (const Vec3& p : hull_.vertices) {
      const int side =
          collision::orientation(plane.corners[0], plane.corners[1], plane.corners[2], p);
      if (side == 0) continue;
      return -collision::orientation(body_.points[t[0]], body_.points[t[1]], body_.points[t[2]], p);
    }
    return 0;
  }

 private:
  /// The faces at each point of the body that is a vertex of the hull.
  void linkFaces() {
    const auto less = [](const Vec3& a, const Vec3& b) {
      return std::tie(a.x(), a.y(), a.z()) < std::tie(b.x(), b.y(), b.z());
    };
    std::vector<std::uint32_t> order(body_.points.size());
    for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = i;
    std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
      return less(body_.points[a], body_.points[b]);
    });
    std::vector<std::uint32_t> pointOf;
    for (const Vec3& v : hull_.vertices) {
      pointOf.push_back(*std::lower_bound(
          order.begin(), order.end(), v,
          [&](std::uint32_t i, const Vec3& p) { return less(body_.points[i], p); }));
    }
    for (std::uint32_t f = 0; f < hull_.faces.size(); ++f) {
      for (const std::uint32_t corner : hull_.faces[f]) at_[pointOf[corner]].push_back(f);
    }
  }

  const Body& body_;
  collision::Hull hull_;
  std::vector<FacePlane> planes_;
  std::vector<std::vector<std::uint32_t>> at_;
  std::size_t scanned_ = 0;
};

/// +1: every triangle lies exactly in a face and looks out; -1: looks in; 0: neither.
int exactSense(const Body& body, HullOfBody& hull) {
  int sense = 0;
  for (const Corners& t : body.triangles) {
    const FacePlane* face =
        hull.faceOf(t, [](const FacePlane& plane, const Vec3& p) { return plane.holds(p); });
    if (face == nullptr) return 0;
    const int own = hull.senseOf(t, *face);
    if (own == 0 || (sense != 0 && own != sense)) return 0;
    sense = own;
  }
  return sense;
}

bool isRounded(const Body& body, HullOfBody& hull, double sixfold) {
  if (!(2 * std::abs(sixfold) > hull.sixfoldVolume())) return false;
  return std::all_of(body.triangles.begin(), body.triangles.end(), [&](const Corners& t) {
    return hull.faceOf(t, [](const FacePlane& plane, const Vec3& p) { return plane.near(p); }) !=
           nullptr;
  });
}

}  // namespace

ConvexityVerdict judgeConvexity(std::span<const Eigen::Vector3f> vertices,
                                std::span<const Corners> triangles) {
  ConvexityVerdict verdict;
  const Body body = bodyOf(vertices, triangles);
  const double sixfold = sixfoldVolume(body);
  verdict.inward = sixfold < 0;
  if (clearlyNotConvex(body)) return verdict;
  if (body.points.size() > kMostVertices) {
    verdict.untried = true;
    return verdict;
  }
  HullOfBody hull(body);
  if (!hull.isSolid()) return verdict;
  const int sense = exactSense(body, hull);
  if (sense != 0) {
    verdict.kind = Shell::Kind::convex;
    verdict.inward = sense < 0;
  } else if (isRounded(body, hull, sixfold)) {
    verdict.kind = Shell::Kind::rounded;
  }
  verdict.untried = verdict.kind == Shell::Kind::closed && hull.gaveUp();
  return verdict;
}

}  // namespace enfilade::scene
