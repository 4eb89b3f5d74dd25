// CollisionGeometry: hulls and triangle trees from an object's meshes, for collision. Convex solids
// become hulls; the rest stays triangles.
#pragma once

#include <cstdint>
#include <vector>

#include "collision/compound/compound_view.hpp"
#include "collision/narrow_phase/narrow_phase.hpp"
#include "collision/shapes/box_tree.hpp"
#include "collision/shapes/hull.hpp"
#include "collision/shapes/triangle_tree.hpp"
#include "scene/model/shapes/shape.hpp"

namespace enfilade::scene {

/// In the frame in which the shape was placed, metres. A part's index is that of its hull, or the
/// number of hulls + the index of its triangle.
struct CollisionGeometry {
  /// Hulls and triangles are stored relative to this nearby point, so that objects far from the
  /// scene's origin lose no digits. The subtraction was exact: the parts did not move.
  Vec3 origin = Vec3::Zero();
  /// Each hull contains every triangle of its surface. It equals the surface's solid exactly, or up
  /// to the rounding of the coordinates (convex_surface.hpp).
  std::vector<collision::Hull> localHulls;
  collision::TriangleTree localTriangles;  ///< closed sets, without thickness
  /// Per triangle: 0 if its surface is open. If it is closed, 1 for counter-clockwise seen from
  /// outside, -1 for clockwise (the placement mirrors).
  std::vector<signed char> windingSigns;

  std::vector<Aabb> hullBoxes;  ///< not relative to the origin
  collision::BoxTree hullTree;  ///< over hullBoxes

  std::uint32_t hullCount() const { return static_cast<std::uint32_t>(localHulls.size()); }
  std::uint32_t size() const {
    return hullCount() + static_cast<std::uint32_t>(localTriangles.triangles().size());
  }
  /// Null for a triangle.
  const collision::Hull* hull(std::uint32_t part) const {
    return part < hullCount() ? &localHulls[part] : nullptr;
  }
  /// Part at its position, and its exact AABB.
  collision::PlacedConvex convex(std::uint32_t part) const;
  Aabb box(std::uint32_t part) const;
  /// Appends the indices of all parts whose AABBs overlap `box`, ascending.
  void query(const Aabb& box, std::vector<std::uint32_t>& parts) const;
  std::size_t bytes() const;
};

/// An object of more parts is dense: no query lists its parts. Measured by `tick_bench`: 16 is
/// slower in houses, 64 among thousands of small objects.
inline constexpr std::uint32_t kMaxListedParts = 32;

/// Calls visit(part) for each part such that open(box) is true for all branches above it. `box` is
/// of a branch, scene frame, and contains all its parts. A branch is opened after everything before
/// it has been visited: hulls, then triangles; of two branches the one nearer to `core` (metres,
/// scene frame).
template <class Open, class Visit>
void descendParts(const CollisionGeometry& geometry, const Aabb& core, const Open& open,
                  const Visit& visit) {
  const auto descendTree = [&](const collision::BoxTree& tree, const Vec3& origin,
                               const auto& getPart) {
    using Box = collision::FloatAabb;
    const Vec3 at = origin + tree.origin;
    const Vec3 pad = 0x1p-50 * (at.cwiseAbs().array() + tree.extent).matrix();  // sums below: < 4u
    const Vec3 low = at - pad, high = at + pad;
    const auto toScene = [&](const Box& box) {
      return Aabb{low + Vec3(box.min[0], box.min[1], box.min[2]),
                  high + Vec3(box.max[0], box.max[1], box.max[2])};
    };
    collision::descend(
        tree, [&](const Box& box) { return open(toScene(box)); },
        [&](const Box& a, const Box& b) {
          return computeSquaredGap(toScene(a), core) < computeSquaredGap(toScene(b), core);
        },
        [&](std::uint32_t first, std::uint32_t count) {
          for (std::uint32_t i = first; i < first + count; ++i) visit(getPart(i));
        });
  };
  descendTree(geometry.hullTree, Vec3::Zero(),
              [&](std::uint32_t item) { return geometry.hullTree.order[item]; });
  descendTree(geometry.localTriangles.boxes(), geometry.origin,
              [&](std::uint32_t item) { return geometry.hullCount() + item; });
}

/// `transform` must keep values finite; it may mirror and flatten.
CollisionGeometry buildCollisionGeometry(const Shape& shape, const Eigen::Affine3d& transform);

/// Compound views for nearest-part queries. They point into `geometry`.
std::vector<collision::CompoundView> makeCompoundViews(const CollisionGeometry& geometry);

/// True if a placed triangle has an area in double precision.
bool hasNumericalArea(const collision::Triangle& t);

/// Triangles of an object that have an area, scene frame, in the order of the model.
std::vector<collision::Triangle> collectSolidTriangles(const Model& model, std::uint32_t object);

/// Signed crossing of a ray from `point` with a triangle. The sum over a surface is its winding
/// number: 1 inside a solid whose faces look outwards. Both triangles of an edge give exactly
/// opposite areas, so a ray slips between them only if it meets the edge to the last bit.
int computeCrossing(const collision::Triangle& t, const Vec3& point);

/// True if `point` lies inside a closed surface of the triangles (not of the hulls), by winding
/// number. For points on the surface either result is possible.
bool isInsideTriangleShells(const CollisionGeometry& geometry, const Vec3& point);

}  // namespace enfilade::scene
