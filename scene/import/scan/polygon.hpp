// Triangulates polygons by ear clipping. Private to the import.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "collision/types.hpp"

namespace enfilade::scene {

using collision::Vec3;

/// Corners of the largest polygon; ear clipping takes up to the third power of their number.
inline constexpr std::size_t kMaxPolygonCorners = 1000;

/// Appends the triangles of a simple polygon, convex or not, with its winding. `corners` index
/// `positions`.
void triangulatePolygon(std::span<const std::uint32_t> corners, std::span<const Vec3> positions,
                        std::vector<std::uint32_t>& triangles);

}  // namespace enfilade::scene
