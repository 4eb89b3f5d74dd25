// Schedule of pair checks: a heap of body pairs ordered by their next check time (Lin 1993, section
// 5.1; Mirtich 1996).
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <utility>
#include <vector>

namespace enfilade::collision {

/// Binary heap with changeable keys. The order is by (time, pair), so it does not depend on the
/// order of insertion.
class PairSchedule {
 public:
  using BodyPair = std::pair<std::uint32_t, std::uint32_t>;  ///< first < second
  static BodyPair makePair(std::uint32_t a, std::uint32_t b) {
    return a < b ? BodyPair{a, b} : BodyPair{b, a};
  }
  struct Entry {
    double time;  ///< seconds; may be infinite, never NaN
    BodyPair pair;
  };

  /// Inserts the pair or changes its time (seconds). The ids may be in either order. Throws
  /// std::invalid_argument if the ids are equal or the time is NaN.
  void set(std::uint32_t a, std::uint32_t b, double time);
  /// Returns true if the pair existed.
  bool remove(std::uint32_t a, std::uint32_t b);

  /// Makes all pairs of a body due at `now`, except those due earlier. Call it when a command or an
  /// impulse invalidates the motion bounds of the body.
  void scheduleBodyNow(std::uint32_t body, double now);

  std::optional<double> findTime(std::uint32_t a, std::uint32_t b) const;
  /// All pairs of a body, ascending by the other body.
  std::vector<Entry> findEntries(std::uint32_t body) const;
  /// Removes and returns the earliest entry if it is due at `now`.
  std::optional<Entry> popDue(double now);

  std::size_t size() const { return heap_.size(); }
  /// Checks all invariants. Throws std::logic_error that names the violated one. For tests and
  /// debug builds.
  void validate() const;

 private:
  struct Slot {
    Entry entry;
    std::size_t heapIndex;  ///< index into heap_
  };

  bool isBefore(std::uint32_t p, std::uint32_t q) const;
  void placeSlot(std::size_t index, std::uint32_t slot);
  void siftUp(std::size_t index);
  void siftDown(std::size_t index);
  void restoreHeapOrder(std::uint32_t slot);
  void removeSlot(std::uint32_t slot);
  std::vector<std::uint32_t> findSlots(std::uint32_t body) const;

  std::vector<Slot> slots_;
  std::vector<std::uint32_t> freeSlots_;          ///< slot indices
  std::vector<std::uint32_t> heap_;               ///< slot indices; each before its two children
  std::map<BodyPair, std::uint32_t> slotByPair_;  ///< each pair in both orders
};

}  // namespace enfilade::collision
