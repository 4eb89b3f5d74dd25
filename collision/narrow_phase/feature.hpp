// A feature is a vertex, an edge or a face of a convex body.
#pragma once

#include <cstdint>

namespace enfilade::collision {

/// The smallest feature of a convex body's surface that contains a closest point.
enum class Feature : std::uint8_t { none, vertex, edge, face };

}  // namespace enfilade::collision
