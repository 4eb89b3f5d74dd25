// Graph coloring of contact constraints. Constraints of one color share no dynamic body, so they
// can be solved in parallel and in any order with the same result.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "scene/physics/contact_constraint.hpp"

namespace enfilade::scene {

struct ConstraintColoring {
  std::vector<std::uint32_t> order;  ///< constraint indices by color, ascending within a color
  /// End of each color in `order`. The last color holds constraints without a color, which must be
  /// solved sequentially.
  std::vector<std::uint32_t> ends;
};

/// Below this count, constraints that share a dynamic body keep their order. That order converges
/// better for stacks, whose constraints run from the ground up.
inline constexpr std::size_t kSmallConstraintThreshold = 192;

/// `isDynamic`: one flag a body.
ConstraintColoring colorConstraints(std::span<const ContactConstraint> constraints,
                                    std::span<const std::uint8_t> isDynamic);

}  // namespace enfilade::scene
