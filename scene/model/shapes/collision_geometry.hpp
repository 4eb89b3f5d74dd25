// What an object is for collision: hulls of its convex solids, triangles of the rest.
#pragma once

#include <cstdint>
#include <vector>

#include "collision/compound/compound_distance.hpp"
#include "collision/narrow_phase/narrow_phase.hpp"
#include "collision/shapes/box_tree.hpp"
#include "collision/shapes/hull.hpp"
#include "collision/shapes/triangle_tree.hpp"
#include "scene/model/shapes/shape.hpp"

namespace enfilade::scene {

/// In the frame that the shape was placed in, metres; a part's number is that of its hull, or the
/// number of hulls + the index of its triangle.
struct ObjectParts {
  /// Hulls and triangles are stored relative to this place near them, so that bodies far from the
  /// scene's origin lose no digits. Subtracting it rounded nothing: the parts are where they were.
  Vec3 origin = Vec3::Zero();
  /// Solids: each holds every triangle of its surface, and is the surface's solid exactly, or up to
  /// the rounding of the coordinates (convex_surface.hpp).
  std::vector<collision::Hull> localHulls;
  collision::TriangleTree localTriangles;  ///< closed, without thickness
  /// Of each triangle: 1 when it is part of a closed surface and counter-clockwise seen from
  /// outside, -1 when clockwise (the placement mirrors), 0 when its surface bounds nothing.
  std::vector<signed char> sides;

  std::vector<Box> hullBoxes;   ///< not relative to the origin
  collision::BoxTree hullTree;  ///< over hullBoxes

  std::uint32_t hullCount() const { return static_cast<std::uint32_t>(localHulls.size()); }
  std::uint32_t size() const {
    return hullCount() + static_cast<std::uint32_t>(localTriangles.triangles().size());
  }
  /// Null for a triangle.
  const collision::Hull* hull(std::uint32_t part) const {
    return part < hullCount() ? &localHulls[part] : nullptr;
  }
  /// Where it stands, and its exact box.
  collision::ConvexBody body(std::uint32_t part) const;
  Box box(std::uint32_t part) const;
  /// Appends the numbers of all parts whose boxes overlap `box`, ascending.
  void query(const Box& box, std::vector<std::uint32_t>& parts) const;
  std::size_t bytes() const;
};

/// A surface that looks inwards is a solid turned inside out when no ball of this radius (metres)
/// fits into it; else somebody may mean the room that it is from within, and it stays triangles. A
/// convex solid of volume V and area A holds no ball of a radius above 3 V / A.
inline constexpr double kRoomRadius = 0.3;

/// `placed` must keep its values finite; it may mirror, and flatten.
ObjectParts partsOf(const Shape& shape, const Eigen::Affine3d& placed);

/// For questions about the nearest of them. Points into `parts`.
std::vector<collision::TreeOfParts> treesOf(const ObjectParts& parts);

/// Whether a placed triangle has an area, as far as doubles tell.
bool hasArea(const collision::Triangle& t);

/// Whether collision takes the hull of this surface of the shape, so placed.
bool becomesHull(const Shape& shape, const Shell& shell, const Eigen::Affine3d& placed);

/// Whether `point` lies inside of a closed surface of the triangles (not of the hulls), by how
/// often they go around it. Points on the surface may be told either way.
bool surrounds(const ObjectParts& parts, const Vec3& point);

}  // namespace enfilade::scene
