// Only objects whose boxes touch another box are compared. Their triangles are sorted by their
// planes, rounded to a grid. Of each plane, those whose boxes within the plane overlap are compared
// exactly. Planes that are equal but for rounding may fall into two cells of the grid: such
// surfaces are missed.
#include "scene/model/coplanar_surfaces.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <numeric>
#include <utility>
#include <vector>

#include "collision/broad_phase/sort_and_sweep.hpp"
#include "scene/model/object_box.hpp"

namespace enfilade::scene {
namespace {

constexpr double kMinArea = 0.01;        // square metres, of a triangle
constexpr double kMinOverlap = 1e-3;     // square metres, of two triangles
constexpr double kMaxGap = 1e-4;         // metres; depth in pictures is coarser from afar
constexpr double kBoxMargin = 1e-3;      // metres; covers the gap of surfaces in one plane
constexpr double kMinCosine = 1 - 1e-6;  // of the normals
constexpr double kNormalStep = 1e-3;     // of the grid of planes, of a unit vector's components
constexpr double kDistanceStep = 1e-3;   // of the grid of planes, metres
constexpr double kMaxComparedDistance = 1e7;        // metres; farther surfaces are not compared
constexpr std::size_t kMaxComparisons = 5'000'000;  // of boxes; a few seconds
constexpr std::size_t kMaxRankedTriangles = 2'000'000;

using Triangle = std::array<Vec3, 3>;
using Point = Eigen::Vector2d;
using ObjectPair = std::pair<std::uint32_t, std::uint32_t>;

struct Facet {
  std::array<std::int64_t, 4> plane{};            ///< normal and distance on the grid
  Eigen::Vector2f min, max;                       ///< of its box within the plane
  std::uint32_t object = 0, mesh = 0, first = 0;  ///< `first`: of its three indices
};

Vec3 computeAreaNormal(const Triangle& t) {
  return (t[1] - t[0]).cross(t[2] - t[0]) / 2;
}

/// The two axes along which a plane is drawn: without the largest component of its normal.
std::array<int, 2> choosePlaneAxes(const std::array<std::int64_t, 4>& plane) {
  int largest = 0;
  for (int axis = 1; axis < 3; ++axis)
    if (std::abs(plane[static_cast<std::size_t>(axis)]) >
        std::abs(plane[static_cast<std::size_t>(largest)]))
      largest = axis;
  return {(largest + 1) % 3, (largest + 2) % 3};
}

bool isDrawnOpaque(const Material& material) {
  return material.alpha == Material::Alpha::opaque;
}

bool lookEqual(const Material& a, const Material& b) {
  return a.baseColour == b.baseColour && a.emissive == b.emissive && a.metallic == b.metallic &&
         a.roughness == b.roughness && a.baseColourTexture == b.baseColourTexture;
}

/// Twice the signed area of a polygon.
double computeDoubleArea(const std::vector<Point>& polygon) {
  double area = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Point &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    area += a.x() * b.y() - a.y() * b.x();
  }
  return area;
}

/// The part of a convex polygon to the left of the line from a to b.
std::vector<Point> clip(const std::vector<Point>& polygon, const Point& a, const Point& b) {
  const auto side = [&](const Point& p) {
    return (b - a).x() * (p - a).y() - (b - a).y() * (p - a).x();
  };
  std::vector<Point> kept;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Point &from = polygon[i], &to = polygon[(i + 1) % polygon.size()];
    const double before = side(from), after = side(to);
    if (before >= 0) kept.push_back(from);
    if ((before < 0) != (after < 0)) kept.push_back(from + (to - from) * before / (before - after));
  }
  return kept;
}

double computeOverlap(const Triangle& a, const Triangle& b, const std::array<int, 2>& axes) {
  const auto flatten = [&](const Triangle& t) {
    std::vector<Point> flat;
    for (const Vec3& p : t) flat.emplace_back(p[axes[0]], p[axes[1]]);
    if (computeDoubleArea(flat) < 0) std::swap(flat[1], flat[2]);
    return flat;
  };
  std::vector<Point> rest = flatten(a);
  const std::vector<Point> other = flatten(b);
  for (std::size_t i = 0; i < 3 && !rest.empty(); ++i)
    rest = clip(rest, other[i], other[(i + 1) % 3]);
  return computeDoubleArea(rest) / 2;
}

/// Whether the plane of `of` contains all corners of `t`.
bool containsInPlane(const Triangle& of, const Triangle& t) {
  const Vec3 normal = computeAreaNormal(of).normalized();
  return std::ranges::all_of(
      t, [&](const Vec3& p) { return std::abs(normal.dot(p - of[0])) <= kMaxGap; });
}

std::size_t countTriangles(const Model& model, const Object& object) {
  std::size_t triangles = 0;
  for (const std::uint32_t mesh : object.meshes) triangles += model.meshes[mesh].triangleCount();
  return triangles;
}

/// By object: whether its box touches that of another one.
std::vector<bool> findTouchingObjects(const Model& model) {
  std::vector<Aabb> boxes;
  std::vector<std::uint32_t> objects;
  for (std::uint32_t i = 0; i < model.objects.size(); ++i) {
    const Aabb box = computeWorldAabb(model, model.objects[i]);
    if (box.empty()) continue;
    boxes.push_back(collision::inflate(box, kBoxMargin));
    objects.push_back(i);
  }
  // Boxes that a larger box found are not searched again: n boxes at one place cost one query.
  std::vector<std::size_t> bySize(boxes.size());
  std::iota(bySize.begin(), bySize.end(), std::size_t{0});
  std::ranges::stable_sort(bySize, std::ranges::greater(),
                           [&](std::size_t i) { return boxes[i].size().squaredNorm(); });
  const collision::SortAndSweep broadPhase(boxes);
  std::vector<bool> touches(model.objects.size(), false);
  for (const std::size_t i : bySize) {
    if (touches[objects[i]]) continue;
    const std::vector<collision::StaticId> found = broadPhase.overlapStatic(boxes[i]);
    if (found.size() < 2) continue;  // itself alone
    for (const collision::StaticId other : found) touches[objects[other]] = true;
  }
  return touches;
}

class CoplanarSearch {
 public:
  CoplanarSearch(const Model& model, std::size_t maxTriangles)
      : model_(model), trianglesLeft_(maxTriangles), bodyOfObject_(mapObjectsToBodies(model)) {}

  CoplanarSurfaces run() {
    const std::vector<bool> touches = findTouchingObjects(model_);
    for (std::uint32_t i = 0; i < model_.objects.size(); ++i)
      if (touches[i]) collectFacets(i);
    std::ranges::sort(facets_, [](const Facet& a, const Facet& b) {
      return std::pair(a.plane, std::pair(a.min.x(), a.object)) <
             std::pair(b.plane, std::pair(b.min.x(), b.object));
    });
    for (std::size_t i = 0; i < facets_.size() && comparisons_ <= kMaxComparisons; ++i)
      compareWithNext(i);
    for (const auto& [pair, looksEqual] : pairs_)
      found_.pairs.push_back({pair.first, pair.second, looksEqual});
    if (largestOverlap_ > 0)
      found_.example =
          model_.objects[largest_.first].path + " and " + model_.objects[largest_.second].path;
    return std::move(found_);
  }

 private:
  const Material& getMaterial(const Facet& facet) const {
    return findMaterial(model_, model_.meshes[facet.mesh]);
  }

  Triangle getTriangle(const Facet& facet) const {
    const Mesh& mesh = model_.meshes[facet.mesh];
    const Eigen::Affine3d& transform = model_.objects[facet.object].worldFromMesh;
    Triangle t;
    for (std::size_t k = 0; k < 3; ++k)
      t[k] = transform * mesh.positions[mesh.indices[facet.first + k]].cast<double>();
    if (transform.linear().determinant() < 0) std::swap(t[1], t[2]);
    return t;
  }

  void collectFacets(std::uint32_t index) {
    const Object& object = model_.objects[index];
    if (object.usage == Object::Usage::collisionOnly) return;
    if (bodyOfObject_[index] && isTrigger(bodyOfObject_[index]->kind)) return;
    const std::size_t triangles = countTriangles(model_, object);
    if (triangles > trianglesLeft_) {
      found_.isComplete = false;
      return;
    }
    trianglesLeft_ -= triangles;
    for (const std::uint32_t mesh : object.meshes) {
      if (!isDrawnOpaque(findMaterial(model_, model_.meshes[mesh]))) continue;
      const std::size_t indices = model_.meshes[mesh].indices.size();
      for (std::uint32_t first = 0; first + 2 < indices; first += 3) {
        Facet facet;
        facet.object = index, facet.mesh = mesh, facet.first = first;
        if (placeFacet(facet)) facets_.push_back(facet);
      }
    }
  }

  /// Returns false for a facet that is too small or too far away.
  bool placeFacet(Facet& facet) const {
    const Triangle t = getTriangle(facet);
    const Vec3 areaNormal = computeAreaNormal(t);
    const double area = areaNormal.norm();
    if (!(area >= kMinArea) || !(t[0].cwiseAbs().maxCoeff() <= kMaxComparedDistance)) return false;
    const Vec3 normal = areaNormal / area;
    for (int axis = 0; axis < 3; ++axis)
      facet.plane[static_cast<std::size_t>(axis)] = std::llround(normal[axis] / kNormalStep);
    facet.plane[3] = std::llround(normal.dot(t[0]) / kDistanceStep);
    const std::array<int, 2> axes = choosePlaneAxes(facet.plane);
    for (int i = 0; i < 2; ++i) {
      const int axis = axes[static_cast<std::size_t>(i)];
      const auto [low, high] = std::minmax({t[0][axis], t[1][axis], t[2][axis]});
      facet.min[i] = static_cast<float>(low), facet.max[i] = static_cast<float>(high);
    }
    return true;
  }

  void compareWithNext(std::size_t at) {
    const Facet& a = facets_[at];
    for (std::size_t next = at + 1; next < facets_.size(); ++next) {
      const Facet& b = facets_[next];
      if (b.plane != a.plane || b.min.x() >= a.max.x()) return;
      if (b.object == a.object) continue;
      if (++comparisons_ > kMaxComparisons) {
        found_.isComplete = false;
        return;
      }
      if (b.min.y() >= a.max.y() || a.min.y() >= b.max.y()) continue;
      const ObjectPair pair = std::minmax(a.object, b.object);
      const bool looksEqual = lookEqual(getMaterial(a), getMaterial(b));
      if (looksEqual && pairs_.contains(pair)) continue;
      const double overlap = computeCoplanarOverlap(a, b);
      if (overlap < kMinOverlap) continue;
      bool& pairLooksEqual = pairs_.try_emplace(pair, true).first->second;
      if (looksEqual) continue;
      pairLooksEqual = false;
      if (overlap > largestOverlap_) largest_ = pair;
      largestOverlap_ = std::max(overlap, largestOverlap_);
    }
  }

  /// Square metres; 0 for facets of different planes.
  double computeCoplanarOverlap(const Facet& a, const Facet& b) const {
    const Triangle first = getTriangle(a), second = getTriangle(b);
    const double cosine =
        computeAreaNormal(first).normalized().dot(computeAreaNormal(second).normalized());
    if (cosine < kMinCosine) return 0;
    if (!containsInPlane(first, second) && !containsInPlane(second, first)) return 0;
    return computeOverlap(first, second, choosePlaneAxes(a.plane));
  }

  const Model& model_;
  std::size_t trianglesLeft_;
  const std::vector<const BodySpec*> bodyOfObject_;
  std::vector<Facet> facets_;
  std::map<ObjectPair, bool> pairs_;  ///< whether they look equal
  ObjectPair largest_;                ///< of those that do not
  double largestOverlap_ = 0;         ///< projected, square metres; 0: there are none
  std::size_t comparisons_ = 0;
  CoplanarSurfaces found_;
};

std::size_t countTriangles(const Model& model) {
  std::size_t triangles = 0;
  for (const Object& object : model.objects) triangles += countTriangles(model, object);
  return triangles;
}

}  // namespace

std::size_t CoplanarSurfaces::countDifferentLooks() const {
  return static_cast<std::size_t>(std::ranges::count(pairs, false, &CoplanarPair::looksEqual));
}

CoplanarSurfaces findCoplanarSurfaces(const Model& model, std::size_t maxTriangles) {
  return CoplanarSearch(model, maxTriangles).run();
}

std::vector<CoplanarRank> rankCoplanarObjects(const Model& model) {
  constexpr std::uint8_t kMaxRank = 31;  // OpenGL draws by so many steps behind a plane
  constexpr double kMargin = 1e-3;       // metres
  constexpr double kEndless = std::numeric_limits<double>::infinity();
  const Aabb everywhere{Vec3::Constant(-kEndless), Vec3::Constant(kEndless)};
  std::vector<CoplanarRank> ranks(model.objects.size());
  if (countTriangles(model) > kMaxRankedTriangles) return ranks;
  std::map<std::uint32_t, std::vector<std::uint32_t>> partners;
  for (const CoplanarPair& pair : findCoplanarSurfaces(model).pairs) {
    partners[pair.first].push_back(pair.second);
    partners[pair.second].push_back(pair.first);
  }
  std::map<std::uint32_t, Aabb> boxes;
  std::vector<std::pair<double, std::uint32_t>> bySize;
  for (const auto& [object, others] : partners) {
    const Aabb& box = boxes[object] = computeWorldAabb(model, model.objects[object]);
    bySize.emplace_back(box.size().norm(), object);
  }
  // An object yields to those of its partners that are smaller.
  std::ranges::sort(bySize);
  const std::vector<const BodySpec*> bodyOfObject = mapObjectsToBodies(model);
  std::vector<bool> isRanked(model.objects.size(), false);
  for (const auto& [size, object] : bySize) {
    CoplanarRank& own = ranks[object];
    for (const std::uint32_t other : partners[object]) {
      if (!isRanked[other] || ranks[other].rank == kMaxRank) continue;
      own.rank = std::max<std::uint8_t>(own.rank, ranks[other].rank + 1);
      const bool moves = bodyOfObject[object] || bodyOfObject[other];
      own.lower.push_back(moves ? everywhere : collision::inflate(boxes[other], kMargin));
    }
    isRanked[object] = true;
  }
  return ranks;
}

}  // namespace enfilade::scene
