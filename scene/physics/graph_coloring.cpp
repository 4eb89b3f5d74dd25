// Greedy coloring in the order of the constraints, as in Box2D v3 (Catto 2024). A constraint gets
// the first color that neither body has, or is solved sequentially if all colors are used. Where
// the order counts, it gets the first color after all colors of its bodies.
#include "scene/physics/graph_coloring.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <numeric>

#include "collision/assert.hpp"

namespace enfilade::scene {
namespace {

// Bits of a body's set of colors. A constraint is left over only if other constraints of its two
// bodies have all of them.
constexpr std::uint32_t kMaxColors = 32;

/// Gives a constraint the first color after those of all earlier constraints that share a body.
ConstraintColoring colorInOrder(std::span<const ContactConstraint> constraints,
                                std::span<const std::uint8_t> isDynamic) {
  std::vector<std::uint32_t> nextRanks(isDynamic.size(), 0), ranks(constraints.size());
  std::uint32_t count = 0;
  for (std::size_t k = 0; k < constraints.size(); ++k) {
    const std::uint32_t a = constraints[k].a, b = constraints[k].b;
    ranks[k] = std::max(isDynamic[a] ? nextRanks[a] : 0, isDynamic[b] ? nextRanks[b] : 0);
    nextRanks[a] = nextRanks[b] = ranks[k] + 1;
    count = std::max(count, ranks[k] + 1);
  }
  ConstraintColoring coloring;
  coloring.order.resize(constraints.size());
  std::iota(coloring.order.begin(), coloring.order.end(), 0u);
  std::stable_sort(coloring.order.begin(), coloring.order.end(),
                   [&](std::uint32_t k, std::uint32_t l) { return ranks[k] < ranks[l]; });
  coloring.ends.assign(count + 1, 0);
  for (const std::uint32_t rank : ranks) ++coloring.ends[rank];
  std::partial_sum(coloring.ends.begin(), coloring.ends.end(), coloring.ends.begin());
  ENFILADE_ASSERT(coloring.ends.back() == constraints.size());
  return coloring;
}

}  // namespace

ConstraintColoring colorConstraints(std::span<const ContactConstraint> constraints,
                                    std::span<const std::uint8_t> isDynamic) {
  if (constraints.size() < kSmallConstraintThreshold) return colorInOrder(constraints, isDynamic);
  std::vector<std::uint32_t> usedColors(isDynamic.size(), 0), colors(constraints.size());
  std::array<std::uint32_t, kMaxColors + 1> counts{};
  for (std::size_t k = 0; k < constraints.size(); ++k) {
    const std::uint32_t a = constraints[k].a, b = constraints[k].b;
    ENFILADE_ASSERT(a < isDynamic.size() && b < isDynamic.size());
    const std::uint32_t used =
        (isDynamic[a] ? usedColors[a] : 0) | (isDynamic[b] ? usedColors[b] : 0);
    const auto color = static_cast<std::uint32_t>(std::countr_one(used));  // kMaxColors: none left
    colors[k] = color;
    ++counts[color];
    if (color == kMaxColors) continue;
    usedColors[a] |= 1u << color, usedColors[b] |= 1u << color;
  }
  ConstraintColoring coloring;
  std::array<std::uint32_t, kMaxColors + 1> next{};
  std::uint32_t end = 0;
  for (std::uint32_t color = 0; color <= kMaxColors; ++color) {
    next[color] = end;
    end += counts[color];
    if (counts[color] > 0 || color == kMaxColors) coloring.ends.push_back(end);
  }
  ENFILADE_ASSERT(end == constraints.size());
  coloring.order.resize(constraints.size());
  for (std::uint32_t k = 0; k < constraints.size(); ++k) coloring.order[next[colors[k]]++] = k;
  return coloring;
}

}  // namespace enfilade::scene
