// The end points of the movers, sorted on three axes and repaired by insertion (seed 5.2.2).
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "collision/broad_phase/signed_bounds.hpp"

namespace enfilade::collision {

/// What a repair found: two movers whose overlap has changed. `a` < `b`.
struct MoverChange {
  std::uint32_t a, b;
  bool begins;
};

/// Keeps one list of end points an axis, ascending; at equal coordinates lower ends come first, so
/// that closed intervals which touch are in the order of intervals which overlap.
class MoverLists {
 public:
  static constexpr std::uint32_t kMostMovers = 0x7fffffff;  ///< ids are below

  /// Boxes of all movers of an update are set first; then the lists are changed.
  void setReach(std::uint32_t mover, const HalfAxes& reach) {
    if (mover >= reach_.size()) makeRoomFor(mover);
    reach_[mover] = reach;
  }

  /// Takes movers out of the lists; tells nothing.
  void remove(std::span<const std::uint32_t> movers);
  /// Repairs the lists after the mover's box changed. Appends to `changes` each exchange of a lower
  /// and an upper end whose status is confirmed by the boxes; one change may be told twice.
  void move(std::uint32_t mover, std::vector<MoverChange>& changes);
  /// Takes movers into the lists and appends their overlaps with all movers in the lists.
  void insert(std::span<const std::uint32_t> movers, std::vector<MoverChange>& changes);

  /// After an update, of each mover that was moved or inserted: its box is what it was from now on.
  void settle(std::span<const std::uint32_t> movers);

  std::uint64_t exchanges = 0;  ///< counted up; the caller resets them
  std::uint64_t boxTests = 0;

 private:
  struct End {
    double at;
    std::uint32_t tag;  ///< 2 * mover + (1 for the upper end)
    bool upper() const { return (tag & 1) != 0; }
    std::uint32_t mover() const { return tag >> 1; }
  };
  static bool before(const End& a, const End& b) {
    return a.at != b.at ? a.at < b.at : a.upper() < b.upper();
  }
  /// Before and after the ends of movers stand one at -infinity and one at +infinity, so that no
  /// end has to ask whether it has a neighbour.
  using Ends = std::vector<End>;
  static Ends noEnds() {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    return {{-kInfinity, 0}, {kInfinity, 1}};
  }

  void makeRoomFor(std::uint32_t mover);
  void repair(std::size_t axis, End lower, End upper, std::vector<MoverChange>& changes);
  void bubbleUp(std::size_t axis, End end, std::vector<MoverChange>& changes);
  void bubbleDown(std::size_t axis, End end, std::vector<MoverChange>& changes);
  void exchanged(std::uint32_t mover, std::size_t count, bool opens,
                 std::vector<MoverChange>& changes);
  void renumber(std::size_t axis);
  void sweep(std::span<const std::uint32_t> fresh, std::vector<MoverChange>& changes);
  void confirm(std::uint32_t a, std::uint32_t b, std::vector<MoverChange>& changes);
  std::uint32_t& positionOf(std::size_t axis, std::uint32_t tag) {
    return positions_[tag >> 1][2 * axis + (tag & 1)];
  }

  std::vector<HalfAxes> reach_;    ///< by mover
  std::vector<HalfAxes> settled_;  ///< by mover: as of the last update
  std::array<Ends, 3> ends_{noEnds(), noEnds(), noEnds()};
  std::vector<std::array<std::uint32_t, 6>> positions_;  ///< by mover: of its ends in the lists
  std::vector<std::uint8_t> marked_;                     ///< by mover: removed, or fresh
  std::vector<std::uint32_t> passed_;  ///< scratch: movers of whom an end was exchanged
  std::array<std::vector<std::uint32_t>, 2> open_;  ///< sweep: open movers, old and fresh
};

}  // namespace enfilade::collision
