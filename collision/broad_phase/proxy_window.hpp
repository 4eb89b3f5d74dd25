// A mover's own cell: the space that it roams in for some ticks, and the end points of the still
// boxes in it, sorted on three axes (seed 5.2.2).
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "collision/broad_phase/cell_grid.hpp"
#include "collision/broad_phase/static_grid.hpp"

namespace enfilade::collision {

/// On each half-axis the mover's reach is somewhere in nearest <= reach < farthest; what ends there
/// stands in a list between these borders.
struct MoverCell {
  static constexpr std::uint32_t kBorder = static_cast<std::uint32_t>(-1);
  struct End {
    double at;
    std::uint32_t box;  ///< index into `boxes`, or kBorder
  };
  struct StillBox {
    std::uint32_t id;
    std::uint8_t apart;   ///< bit k: its onset on half-axis k is beyond the reach
    std::uint8_t ending;  ///< bit k: beyond the nearest border, as of when the cell was laid
  };

  HalfAxes nearest{}, farthest{};       ///< borders
  std::array<std::uint32_t, 6> next{};  ///< by half-axis: the first end beyond the reach
  std::vector<End> ends;        ///< six lists, each ascending, a border at either side; room beyond
  std::vector<StillBox> boxes;  ///< all that meet the cell; room beyond

  /// Takes in the boxes of `rows`, all of which meet `farthest`, with the borders that are set.
  /// `met` becomes the ids of those that meet `reach`, in the order of `rows`.
  void lay(const StillCells& still, std::span<const StillCells::Row> rows, const HalfAxes& reach,
           std::vector<std::uint32_t>& met);

  /// Asks for what is read when ends are passed: the first ends, of most cells all, and boxes.
  void prefetch() const {
    constexpr std::size_t kEndsPerLine = 4, kMost = 32;
    for (std::size_t k = 0; k < std::min(kMost, ends.size()); k += kEndsPerLine) {
      __builtin_prefetch(&ends[k]);
    }
    __builtin_prefetch(boxes.data());
  }

  /// The ends beside the reach on half-axis `k`.
  double endBefore(std::size_t k) const { return ends[next[k] - 1].at; }
  double endBeyond(std::size_t k) const { return ends[next[k]].at; }
};

}  // namespace enfilade::collision
