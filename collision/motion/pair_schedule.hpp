// Pairs of bodies by the time at which they are to be looked at again (seed 5.1.2).
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <utility>
#include <vector>

namespace enfilade::collision {

/// A binary heap whose keys can be changed. The order is that of (time, pair), so it is the same
/// whatever was inserted first.
class WakeUpHeap {
 public:
  using BodyPair = std::pair<std::uint32_t, std::uint32_t>;  ///< first < second
  struct Entry {
    double time;  ///< seconds; may be infinite, never NaN
    BodyPair pair;
  };

  /// Inserts the pair or changes its time. The ids in either order, not equal; throws
  /// std::invalid_argument on equal ids or a time that is no number.
  void set(std::uint32_t a, std::uint32_t b, double time);
  /// Whether the pair was there.
  bool remove(std::uint32_t a, std::uint32_t b);
  void removeBody(std::uint32_t body);

  /// A command or an impulse voids what was proved of a body: all its pairs are due at `now`, if
  /// they were not due before.
  void wakeBody(std::uint32_t body, double now);

  std::optional<double> timeOf(std::uint32_t a, std::uint32_t b) const;
  /// The earliest entry; none when empty.
  std::optional<Entry> earliest() const;
  /// Takes the earliest entry out if it is due at `now`.
  std::optional<Entry> popDue(double now);

  std::size_t size() const { return heap_.size(); }
  /// Throws std::logic_error naming what is broken; for tests and debug builds.
  void validate() const;

 private:
  struct Slot {
    Entry entry;
    std::size_t place;  ///< in heap_
  };

  bool before(std::uint32_t p, std::uint32_t q) const;
  void put(std::size_t place, std::uint32_t slot);
  void rise(std::size_t place);
  void sink(std::size_t place);
  void settle(std::uint32_t slot);
  void take(std::uint32_t slot);
  std::vector<std::uint32_t> slotsOf(std::uint32_t body) const;

  std::vector<Slot> slots_;
  std::vector<std::uint32_t> unused_;         ///< slots
  std::vector<std::uint32_t> heap_;           ///< slots; each before its two children
  std::map<BodyPair, std::uint32_t> slotOf_;  ///< each pair both ways round
};

}  // namespace enfilade::collision
