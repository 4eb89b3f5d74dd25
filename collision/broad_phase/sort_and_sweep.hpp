// Broad phase: which boxes overlap, told as changes from tick to tick (seed 5.2.2, I-COLLIDE).
#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "collision/types.hpp"

namespace enfilade::collision {

using StillId = std::uint32_t;  ///< index into the boxes given at construction, or by insertStill()
using MoverId = std::uint32_t;  ///< by insert(); reused after remove() and update()

/// A moving box and a still one, or two moving ones (then `mover` < `other`).
struct BoxPair {
  MoverId mover;
  std::uint32_t other;  ///< a StillId, or a MoverId when `otherMoves`
  bool otherMoves;

  auto operator<=>(const BoxPair&) const = default;
};

/// Counters of the last update(), for metrics and for tests of the complexity claim.
struct SweepCounters {
  std::uint64_t exchanges = 0;   ///< end points that passed one another, on all axes
  std::uint64_t cellsLaid = 0;   ///< times that a mover's surroundings were gathered and sorted
  std::uint64_t stillEdits = 0;  ///< still boxes that came or went
  std::uint64_t rebuilds = 0;    ///< 1 if the cells of all still boxes were built anew
  std::uint64_t boxTests = 0;    ///< full box tests: to lay cells, and of movers that are near
};

/// Keeps the set of overlapping pairs of closed boxes, exactly: after update() it equals what brute
/// force over all boxes finds. Still-still pairs never exist.
class SortAndSweep {
 public:
  /// `stillBoxes` are finite and not empty; throws std::invalid_argument naming the index if not.
  explicit SortAndSweep(std::span<const Box> stillBoxes);
  ~SortAndSweep();
  SortAndSweep(SortAndSweep&&) noexcept;
  SortAndSweep& operator=(SortAndSweep&&) noexcept;

  /// Movers are inserted, moved and removed between updates; the pairs follow at the next update().
  /// Boxes are finite and not empty, movers are there (std::invalid_argument otherwise; nothing is
  /// changed). insert() throws std::length_error above 2^31 - 1 movers.
  MoverId insert(const Box& box);
  void move(MoverId mover, const Box& box);
  void remove(MoverId mover);

  /// What besides the boxes decides how movers go on: a copy needs it to give the same ids and to
  /// tell the same changes.
  struct Roll {
    std::vector<MoverId> free;                     ///< given again, the last one first
    std::vector<std::pair<MoverId, Box>> leaving;  ///< removed since the last update, in order
    bool updated = false;                          ///< there was an update
  };
  Roll roll() const;
  /// Takes these movers in the place of all that are there (`there`: ascending ids, without those
  /// of the roll) as they were after an update. Only before the first update; ids are those of a
  /// broad phase that gave them: throws std::invalid_argument where they cannot be.
  void restore(std::span<const std::pair<MoverId, Box>> there, const Roll& roll);

  /// Still boxes come and go between updates as well, and the pairs follow at the next update(). An
  /// id is free for the next box only after the update that tells the end of its pairs. Cheap while
  /// there are few at a time: after as many edits as half of the boxes all cells are built anew.
  /// removeStill() throws std::invalid_argument if there is no such box, insertStill()
  /// std::length_error above 2^32 - 2 of them. The first edit costs O(n).
  StillId insertStill(const Box& box);
  void removeStill(StillId still);

  /// Repairs the sorted lists and applies the status changes.
  void update();

  /// Status changes of the last update(), sorted; deterministic. Valid until the next one.
  std::span<const BoxPair> begun() const;
  std::span<const BoxPair> ended() const;
  /// All pairs that overlap now in which `mover` takes part as `mover` or (mover-mover pairs) as
  /// `other`, sorted by the partner: still partners first. None for a mover that is not there.
  /// Valid until the next update().
  struct Partner {
    std::uint32_t id;
    bool moves;
    auto operator<=>(const Partner& o) const {
      return moves != o.moves ? moves <=> o.moves : id <=> o.id;
    }
    bool operator==(const Partner&) const = default;
  };
  std::span<const Partner> partners(MoverId mover) const;
  /// The still boxes that overlap a box which is no mover, ascending: for questions asked once, as
  /// whether there is room. Costs what stands in the cells of the box. As of the last update().
  /// Throws std::invalid_argument for a box that is empty or not finite.
  std::vector<StillId> stillOverlapping(const Box& box) const;

  std::size_t pairCount() const;
  std::size_t stillCount() const;              ///< as of the last update()
  std::size_t bytesBesidesStillBoxes() const;  ///< memory of the still side, less 48 bytes a box
  const SweepCounters& counters() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// The slow twin: every pair by brute force, sorted. `moverBoxes` holds live movers with their ids.
std::vector<BoxPair> bruteForcePairs(std::span<const Box> stillBoxes,
                                     std::span<const std::pair<MoverId, Box>> moverBoxes);

}  // namespace enfilade::collision
