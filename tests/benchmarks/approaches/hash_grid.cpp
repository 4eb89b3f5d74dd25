// Uniform spatial subdivision (Lin 1993, section 5.3.2): equal cells, hashed; every box is listed
// in all cells that it overlaps.
//
// Static boxes are listed once, in one array ordered by cell. Dynamic boxes are listed again every
// tick. Only the cell with the low corner of the boxes' intersection reports a pair, so that it is
// reported once.
#include <array>
#include <cmath>

#include "tests/benchmarks/broad_phase_method.hpp"

namespace enfilade::benchmarks {
namespace {

constexpr double kEdge = 2;  // metres: about the size of an avatar, the usual advice

using Place = std::array<std::int32_t, 3>;

Place computePlace(const Vec3& p) {
  const auto along = [&](int axis) {
    return static_cast<std::int32_t>(std::floor(p[axis] / kEdge));
  };
  return {along(0), along(1), along(2)};
}

template <typename Visit>
void forEachPlace(const Aabb& box, Visit&& visit) {
  const Place low = computePlace(box.min);
  const Place high = computePlace(box.max);
  for (std::int32_t x = low[0]; x <= high[0]; ++x) {
    for (std::int32_t y = low[1]; y <= high[1]; ++y) {
      for (std::int32_t z = low[2]; z <= high[2]; ++z) visit(Place{x, y, z});
    }
  }
}

/// Maps cells to numbers 0, 1, 2, ... in the order of their first use; open addressing.
class PlaceTable {
 public:
  static constexpr std::uint32_t kNone = static_cast<std::uint32_t>(-1);

  std::uint32_t find(const Place& place) const {
    if (slots_.empty()) return kNone;
    return slots_[computeSlot(place)];
  }
  std::uint32_t findOrAdd(const Place& place) {
    if (2 * (places_.size() + 1) > slots_.size()) grow();
    const std::size_t slot = computeSlot(place);
    if (slots_[slot] == kNone) {
      slots_[slot] = static_cast<std::uint32_t>(places_.size());
      places_.push_back(place);
    }
    return slots_[slot];
  }
  void clear() {
    std::fill(slots_.begin(), slots_.end(), kNone);
    places_.clear();
  }
  std::size_t size() const { return places_.size(); }

 private:
  std::size_t computeSlot(const Place& place) const {
    // Teschner et al. 2003, "Optimized spatial hashing": three large primes.
    const auto part = [](std::int32_t x, std::uint64_t prime) {
      return static_cast<std::uint64_t>(static_cast<std::uint32_t>(x)) * prime;
    };
    std::uint64_t hash =
        part(place[0], 73856093) ^ part(place[1], 19349663) ^ part(place[2], 83492791);
    hash ^= hash >> 17;
    std::size_t slot = hash & (slots_.size() - 1);
    while (slots_[slot] != kNone && places_[slots_[slot]] != place) {
      slot = (slot + 1) & (slots_.size() - 1);
    }
    return slot;
  }
  void grow() {
    slots_.assign(std::max<std::size_t>(64, 2 * slots_.size()), kNone);
    for (std::uint32_t k = 0; k < places_.size(); ++k) slots_[computeSlot(places_[k])] = k;
  }

  std::vector<std::uint32_t> slots_;
  std::vector<Place> places_;
};

class HashGrid : public BroadPhase {
 public:
  explicit HashGrid(std::span<const Aabb> staticBoxes) : staticBoxes_(staticBoxes) {
    std::vector<std::uint32_t> counts;
    for (const Aabb& box : staticBoxes) {
      forEachPlace(box, [&](const Place& place) {
        const std::uint32_t cell = staticCells_.findOrAdd(place);
        if (cell == counts.size()) counts.push_back(0);
        ++counts[cell];
      });
    }
    first_.assign(counts.size() + 1, 0);
    for (std::size_t k = 0; k < counts.size(); ++k) first_[k + 1] = first_[k] + counts[k];
    listed_.resize(first_.back());
    for (std::uint32_t s = 0; s < staticBoxes.size(); ++s) {
      forEachPlace(staticBoxes[s], [&](const Place& place) {
        const std::uint32_t cell = staticCells_.find(place);
        listed_[first_[cell + 1] - counts[cell]--] = s;
      });
    }
  }

  void runTick(std::span<const Aabb> dynamicBoxes, PairTally& tally) override {
    dynamicCells_.clear();
    for (auto& list : dynamicLists_) list.clear();
    for (std::uint32_t id = 0; id < dynamicBoxes.size(); ++id) {
      forEachPlace(dynamicBoxes[id], [&](const Place& place) {
        reportStatic(id, dynamicBoxes[id], place, tally);
        reportDynamic(id, dynamicBoxes, place, tally);
      });
    }
  }

 private:
  static bool ownsPair(const Place& place, const Aabb& a, const Aabb& b) {
    return computePlace(a.min.cwiseMax(b.min)) == place;
  }

  void reportStatic(std::uint32_t id, const Aabb& box, const Place& place, PairTally& tally) {
    const std::uint32_t cell = staticCells_.find(place);
    if (cell == PlaceTable::kNone) return;
    for (std::uint32_t k = first_[cell]; k < first_[cell + 1]; ++k) {
      const Aabb& other = staticBoxes_[listed_[k]];
      if (collision::overlaps(box, other) && ownsPair(place, box, other)) {
        tally.addStaticPair(id, listed_[k]);
      }
    }
  }

  void reportDynamic(std::uint32_t id, std::span<const Aabb> dynamicBoxes, const Place& place,
                     PairTally& tally) {
    const std::uint32_t cell = dynamicCells_.findOrAdd(place);
    if (cell >= dynamicLists_.size()) dynamicLists_.resize(cell + 1);
    for (const std::uint32_t other : dynamicLists_[cell]) {
      if (collision::overlaps(dynamicBoxes[id], dynamicBoxes[other]) &&
          ownsPair(place, dynamicBoxes[id], dynamicBoxes[other])) {
        tally.addDynamicPair(id, other);
      }
    }
    dynamicLists_[cell].push_back(id);
  }

  std::span<const Aabb> staticBoxes_;
  PlaceTable staticCells_, dynamicCells_;
  std::vector<std::uint32_t> first_;   ///< by cell, plus one: offsets into `listed_`
  std::vector<std::uint32_t> listed_;  ///< static boxes by cell
  std::vector<std::vector<std::uint32_t>> dynamicLists_;
};

}  // namespace

BroadPhaseMethod makeHashGrid() {
  return {"uniform hash grid", BroadPhaseMethod::Kind::approach, SIZE_MAX, "",
          bindMaker<HashGrid>()};
}

}  // namespace enfilade::benchmarks
