#include "scene/model/shapes/convex_surface.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <vector>

#include "collision/shapes/exact_orientation.hpp"
#include "collision/shapes/hull.hpp"

namespace enfilade::scene {
namespace {

using collision::Aabb;
using collision::Vec3;
using Corners = std::array<std::uint32_t, 3>;

constexpr std::size_t kMaxVertices = 1 << 16;    // of a surface whose hull is worth building
constexpr std::size_t kMaxPlaneTests = 1 << 24;  // triangles times faces of one surface
constexpr std::size_t kSampleCount = 64;         // triangles tested before a hull is built

/// A closed surface with its own vertices, in doubles.
struct SurfaceMesh {
  std::vector<Vec3> points;
  std::vector<Corners> triangles;
  Vec3 halfUnits = Vec3::Zero();  ///< half units of rounding of the largest coordinate on each axis
  double extent = 0;              ///< longest side of the AABB
};

SurfaceMesh makeSurfaceMesh(std::span<const Eigen::Vector3f> vertices,
                            std::span<const Corners> triangles) {
  SurfaceMesh surface;
  std::vector<std::uint32_t> used;
  for (const Corners& t : triangles) used.insert(used.end(), t.begin(), t.end());
  std::sort(used.begin(), used.end());
  used.erase(std::unique(used.begin(), used.end()), used.end());
  Aabb box;
  for (const std::uint32_t v : used) {
    surface.points.push_back(vertices[v].cast<double>());
    box.include(surface.points.back());
  }
  for (const Corners& t : triangles) {
    Corners own{};
    for (std::size_t k = 0; k < 3; ++k) {
      own[k] = static_cast<std::uint32_t>(std::lower_bound(used.begin(), used.end(), t[k]) -
                                          used.begin());
    }
    surface.triangles.push_back(own);
  }
  surface.halfUnits = 0x1p-24 * box.min.cwiseAbs().cwiseMax(box.max.cwiseAbs());
  surface.extent = box.size().maxCoeff();
  return surface;
}

double computeSixfoldVolume(const SurfaceMesh& surface) {
  const Vec3& origin = surface.points.front();
  double sum = 0;
  for (const Corners& t : surface.triangles) {
    const Vec3 a = surface.points[t[0]] - origin, b = surface.points[t[1]] - origin,
               c = surface.points[t[2]] - origin;
    sum += a.dot(b.cross(c));
  }
  return sum;
}

/// Quick test: some faces of most non-convex surfaces have points well on both sides. It rejects
/// only surfaces that would fail the full test. A triangle 1e5 d high whose corners lie within d of
/// a face's plane is hardly tilted. No point is beyond it by a thousandth of the extent.
bool isClearlyNotConvex(const SurfaceMesh& surface) {
  const double clear = 1e-3 * surface.extent;
  const double high = 6e5 * surface.halfUnits.sum();
  const std::size_t stride = std::max<std::size_t>(1, surface.triangles.size() / kSampleCount);
  for (std::size_t i = 0; i < surface.triangles.size(); i += stride) {
    const Corners& t = surface.triangles[i];
    const Vec3 a = surface.points[t[0]], ab = surface.points[t[1]] - a,
               ac = surface.points[t[2]] - a;
    const Vec3 normal = ab.cross(ac);
    const double area = normal.norm();
    const double longest = std::max({ab.norm(), ac.norm(), (ac - ab).norm()});
    if (!(area > high * longest)) continue;
    double lowest = 0, highest = 0;
    for (const Vec3& p : surface.points) {
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
  double rounding;  ///< d in the rule (see header)

  FacePlane(const collision::Hull& hull, const std::vector<std::uint32_t>& face,
            const Vec3& halfUnits)
      : corners{hull.vertices[face[0]], hull.vertices[face[1]], hull.vertices[face[2]]} {
    normal = Vec3::Zero();  // Newell's sum: robust if three corners are nearly collinear
    for (std::size_t k = 1; k + 1 < face.size(); ++k) {
      normal += (hull.vertices[face[k]] - corners[0])
                    .cross(hull.vertices[face[k + 1]] - hull.vertices[face[k]]);
    }
    normal /= normal.norm();
    height = normal.dot(corners[0]);
    rounding = 6 * normal.cwiseAbs().dot(halfUnits);
  }

  bool isNear(const Vec3& p) const { return height - normal.dot(p) <= rounding; }
  bool contains(const Vec3& p) const {
    return isNear(p) && collision::orient3d(corners[0], corners[1], corners[2], p) == 0;
  }
};

class SurfaceHull {
 public:
  explicit SurfaceHull(const SurfaceMesh& surface)
      : surface_(surface),
        hull_(collision::buildHull(surface.points)),
        facesAtPoint_(surface.points.size()) {
    for (const auto& face : hull_.faces) planes_.emplace_back(hull_, face, surface.halfUnits);
    linkFaces();
  }

  bool isSolid() const { return planes_.size() >= 4; }

  double computeSixfoldVolume() const {
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

  /// The first face found for which `predicate(plane, corner)` is true for all corners of the
  /// triangle.
  template <class Predicate>
  const FacePlane* findFace(const Corners& t, const Predicate& predicate) {
    const auto all = [&](const FacePlane& plane) {
      return predicate(plane, surface_.points[t[0]]) && predicate(plane, surface_.points[t[1]]) &&
             predicate(plane, surface_.points[t[2]]);
    };
    for (const std::uint32_t corner : t) {
      for (const std::uint32_t face : facesAtPoint_[corner]) {
        if (all(planes_[face])) return &planes_[face];
      }
    }
    // Its corners are not vertices of the hull, or its face begins elsewhere.
    for (const FacePlane& plane : planes_) {
      if (++scanned_ > kMaxPlaneTests) return nullptr;
      if (all(plane)) return &plane;
    }
    return nullptr;
  }

  bool budgetExhausted() const { return scanned_ > kMaxPlaneTests; }

  /// Exact: +1 if the triangle, which lies in `plane`, faces out of the hull; -1 if into it.
  int computeSense(const Corners& t, const FacePlane& plane) const {
    for (const Vec3& p : hull_.vertices) {
      const int side = collision::orient3d(plane.corners[0], plane.corners[1], plane.corners[2], p);
      if (side == 0) continue;
      return -collision::orient3d(surface_.points[t[0]], surface_.points[t[1]],
                                  surface_.points[t[2]], p);
    }
    return 0;
  }

 private:
  /// Lists the faces at each point of the surface that is a vertex of the hull.
  void linkFaces() {
    const auto less = [](const Vec3& a, const Vec3& b) {
      return std::tie(a.x(), a.y(), a.z()) < std::tie(b.x(), b.y(), b.z());
    };
    std::vector<std::uint32_t> order(surface_.points.size());
    for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = i;
    std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
      return less(surface_.points[a], surface_.points[b]);
    });
    std::vector<std::uint32_t> pointOf;
    for (const Vec3& v : hull_.vertices) {
      pointOf.push_back(*std::lower_bound(
          order.begin(), order.end(), v,
          [&](std::uint32_t i, const Vec3& p) { return less(surface_.points[i], p); }));
    }
    for (std::uint32_t f = 0; f < hull_.faces.size(); ++f) {
      for (const std::uint32_t corner : hull_.faces[f]) facesAtPoint_[pointOf[corner]].push_back(f);
    }
  }

  const SurfaceMesh& surface_;
  collision::Hull hull_;
  std::vector<FacePlane> planes_;
  std::vector<std::vector<std::uint32_t>> facesAtPoint_;
  std::size_t scanned_ = 0;
};

/// +1: every triangle lies exactly in a face and faces out; -1: all face in; 0: otherwise.
int computeExactSense(const SurfaceMesh& surface, SurfaceHull& hull) {
  int sense = 0;
  for (const Corners& t : surface.triangles) {
    const FacePlane* face =
        hull.findFace(t, [](const FacePlane& plane, const Vec3& p) { return plane.contains(p); });
    if (face == nullptr) return 0;
    const int own = hull.computeSense(t, *face);
    if (own == 0 || (sense != 0 && own != sense)) return 0;
    sense = own;
  }
  return sense;
}

bool isNearlyConvex(const SurfaceMesh& surface, SurfaceHull& hull, double sixfold) {
  if (!(2 * std::abs(sixfold) > hull.computeSixfoldVolume())) return false;
  return std::all_of(surface.triangles.begin(), surface.triangles.end(), [&](const Corners& t) {
    return hull.findFace(
               t, [](const FacePlane& plane, const Vec3& p) { return plane.isNear(p); }) != nullptr;
  });
}

}  // namespace

ConvexityResult classifyConvexity(std::span<const Eigen::Vector3f> vertices,
                                  std::span<const Corners> triangles) {
  ConvexityResult verdict;
  const SurfaceMesh surface = makeSurfaceMesh(vertices, triangles);
  const double sixfold = computeSixfoldVolume(surface);
  verdict.inward = sixfold < 0;
  if (isClearlyNotConvex(surface)) return verdict;
  if (surface.points.size() > kMaxVertices) {
    verdict.notTested = true;
    return verdict;
  }
  SurfaceHull hull(surface);
  if (!hull.isSolid()) return verdict;
  const int sense = computeExactSense(surface, hull);
  if (sense != 0) {
    verdict.kind = Shell::Kind::convex;
    verdict.inward = sense < 0;
  } else if (isNearlyConvex(surface, hull, sixfold)) {
    verdict.kind = Shell::Kind::nearlyConvex;
  }
  verdict.notTested = verdict.kind == Shell::Kind::closed && hull.budgetExhausted();
  return verdict;
}

}  // namespace enfilade::scene
