// One interface for every broad phase that is measured: ours, the other approaches of the seed
// (5.2.3, 5.3) and the peers.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "collision/broad_phase/sort_and_sweep.hpp"

namespace enfilade::benchmarks {

using collision::Box;
using collision::BoxPair;
using collision::Vec3;

/// What a method has to tell every tick: all of its pairs, in any order, each once. Keeps a number
/// and a sum of mixed ids, so that two sets can be compared every tick at a nanosecond a pair;
/// `kept`, when given, collects the pairs themselves.
struct PairTally {
  std::uint64_t count = 0, sum = 0;
  std::vector<BoxPair>* kept = nullptr;

  void addStill(std::uint32_t mover, std::uint32_t still) { add({mover, still, false}); }
  /// Two movers, in any order.
  void addMovers(std::uint32_t a, std::uint32_t b) { add({std::min(a, b), std::max(a, b), true}); }
  bool sameAs(const PairTally& other) const { return count == other.count && sum == other.sum; }

 private:
  /// The finishing step of splitmix64 (Steele, Lea and Flood 2014).
  static std::uint64_t mixed(std::uint64_t x) {
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
    return x ^ (x >> 31);
  }
  void add(const BoxPair& pair) {
    const std::uint64_t other = 2 * std::uint64_t{pair.other} + (pair.otherMoves ? 1 : 0);
    sum += mixed((std::uint64_t{pair.mover} << 33) + other + 1);
    ++count;
    if (kept != nullptr) kept->push_back(pair);
  }
};

/// Holds still boxes since its construction and movers since its first tick.
class BroadPhase {
 public:
  virtual ~BroadPhase() = default;
  /// Takes every mover to its new box (on the first call: inserts them) and tells all pairs of
  /// closed boxes that overlap, exactly: a mover and a still box, or two movers.
  virtual void tick(std::span<const Box> movers, PairTally& tally) = 0;
  /// Bytes that malloc does not know of.
  virtual std::size_t hiddenBytes() const { return 0; }
  /// Whether it goes on reading the still boxes that it was given, so that it needs no copy of
  /// them.
  virtual bool readsGivenBoxes() const { return true; }
};

struct BroadPhaseMethod {
  std::string name;
  enum class Kind { ours, approach, peer } kind;
  /// Left out above so many still objects, and for this reason.
  std::size_t mostObjects;
  std::string reason;
  /// `still` outlives the method.
  std::function<std::unique_ptr<BroadPhase>(std::span<const Box> still)> make;
};

template <typename Method, typename... Arguments>
auto maker(Arguments... arguments) {
  return [arguments...](std::span<const Box> still) -> std::unique_ptr<BroadPhase> {
    return std::make_unique<Method>(still, arguments...);
  };
}

/// All that were there at configure time: ours first, then the approaches, then the peers.
std::vector<BroadPhaseMethod> broadPhaseMethods();

// One for each source file.
BroadPhaseMethod ourSortAndSweep();
BroadPhaseMethod bruteForce();
BroadPhaseMethod hashGrid();
BroadPhaseMethod looseOctree();
BroadPhaseMethod bspTree();
BroadPhaseMethod intervalTree();
BroadPhaseMethod boostRtree();
BroadPhaseMethod cgalBoxes();
BroadPhaseMethod embreeBvh();
std::vector<BroadPhaseMethod> bulletBroadPhases();
std::vector<BroadPhaseMethod> fclBroadPhases();
std::vector<BroadPhaseMethod> odeSpaces();

}  // namespace enfilade::benchmarks
