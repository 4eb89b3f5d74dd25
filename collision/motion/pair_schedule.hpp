// Schedule of pair checks: body pairs ordered by their next check time (Lin 1993, section 5.1;
// Mirtich 1996).
#pragma once

#include <compare>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

namespace enfilade::collision {

/// Priority queue with changeable keys. The order is by (time, pair), so it does not depend on the
/// order of insertion.
class PairSchedule {
 public:
  using BodyPair = std::pair<std::uint32_t, std::uint32_t>;  ///< first < second
  struct Entry {
    double time;  ///< seconds; may be infinite, never NaN
    BodyPair pair;

    auto operator<=>(const Entry&) const = default;
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

  std::size_t size() const { return queue_.size(); }
  /// Throws std::logic_error if the two containers disagree. For tests and debug builds.
  void validate() const;

 private:
  std::set<Entry> queue_;
  std::map<BodyPair, double> times_;  ///< each pair in both orders
};

}  // namespace enfilade::collision
