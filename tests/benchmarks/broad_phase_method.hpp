// Interface of every benchmarked broad phase: ours, other approaches of Lin (1993, sections 5.2.3
// and 5.3) and peers.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "collision/broad_phase/sort_and_sweep.hpp"

namespace enfilade::benchmarks {

using collision::Aabb;
using collision::ProxyPair;
using collision::Vec3;

/// The pairs that a method must report each tick, each once and in any order. Stores their number
/// and a sum of mixed ids, which compares two sets for a nanosecond a pair. `kept`, if given,
/// collects the pairs themselves.
struct PairTally {
  std::uint64_t count = 0, sum = 0;
  std::vector<ProxyPair>* kept = nullptr;

  void addStaticPair(std::uint32_t dynamicBox, std::uint32_t staticBoxes) {
    add({dynamicBox, staticBoxes, false});
  }
  /// Two dynamic proxies, in any order.
  void addDynamicPair(std::uint32_t a, std::uint32_t b) {
    add({std::min(a, b), std::max(a, b), true});
  }
  bool isSameAs(const PairTally& other) const { return count == other.count && sum == other.sum; }

 private:
  /// Finalizer of splitmix64 (Steele, Lea and Flood 2014).
  static std::uint64_t mixBits(std::uint64_t x) {
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
    return x ^ (x >> 31);
  }
  void add(const ProxyPair& pair) {
    const std::uint64_t other = 2 * std::uint64_t{pair.other} + (pair.otherIsDynamic ? 1 : 0);
    sum += mixBits((std::uint64_t{pair.proxy} << 33) + other + 1);
    ++count;
    if (kept != nullptr) kept->push_back(pair);
  }
};

/// Holds static boxes from its construction and dynamic proxies from its first tick.
class BroadPhase {
 public:
  virtual ~BroadPhase() = default;
  /// Moves every proxy to its new box; the first call inserts them. Reports exactly all overlapping
  /// pairs of closed boxes: a dynamic and a static one, or two dynamic ones.
  virtual void runTick(std::span<const Aabb> dynamicBoxes, PairTally& tally) = 0;
  /// Bytes allocated without malloc.
  virtual std::size_t countHiddenBytes() const { return 0; }
  /// Whether the method reads the given static boxes after construction, so that it needs no copy.
  virtual bool readsGivenBoxes() const { return true; }
};

struct BroadPhaseMethod {
  std::string name;
  enum class Kind { ours, approach, peer } kind;
  /// The method is skipped above this number of static objects, for `reason`.
  std::size_t maxObjects;
  std::string reason;
  /// `staticBoxes` outlives the method.
  std::function<std::unique_ptr<BroadPhase>(std::span<const Aabb> staticBoxes)> make;
  std::size_t maxDynamicBoxes = SIZE_MAX;  ///< the method is skipped above it
};

template <typename Method, typename... Arguments>
auto bindMaker(Arguments... arguments) {
  return [arguments...](std::span<const Aabb> staticBoxes) -> std::unique_ptr<BroadPhase> {
    return std::make_unique<Method>(staticBoxes, arguments...);
  };
}

/// All methods found at configure time: ours first, then other approaches, then peers.
std::vector<BroadPhaseMethod> makeBroadPhaseMethods();

// Factories, one per source file.
BroadPhaseMethod makeOurSortAndSweep();
BroadPhaseMethod makeBruteForce();
BroadPhaseMethod makeHashGrid();
BroadPhaseMethod makeLooseOctree();
BroadPhaseMethod makeBspTree();
BroadPhaseMethod makeIntervalTree();
BroadPhaseMethod makeBoostRtree();
BroadPhaseMethod makeCgalBoxes();
BroadPhaseMethod makeEmbreeBvh();
std::vector<BroadPhaseMethod> makeBulletBroadPhases();
std::vector<BroadPhaseMethod> makeFloatBulletBroadPhases();
std::vector<BroadPhaseMethod> makeFclBroadPhases();
std::vector<BroadPhaseMethod> makeOdeSpaces();

}  // namespace enfilade::benchmarks
