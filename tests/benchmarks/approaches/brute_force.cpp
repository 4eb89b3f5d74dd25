// Broad phase by brute force: every mover against every static box and every other mover.
#include "tests/benchmarks/broad_phase_method.hpp"

namespace enfilade::benchmarks {
namespace {

class BruteForce : public BroadPhase {
 public:
  explicit BruteForce(std::span<const Aabb> still) : still_(still) {}

  void tick(std::span<const Aabb> movers, PairTally& tally) override {
    for (std::uint32_t a = 0; a < movers.size(); ++a) {
      for (std::uint32_t s = 0; s < still_.size(); ++s) {
        if (collision::overlaps(movers[a], still_[s])) tally.addStill(a, s);
      }
      for (std::uint32_t b = a + 1; b < movers.size(); ++b) {
        if (collision::overlaps(movers[a], movers[b])) tally.addMovers(a, b);
      }
    }
  }

 private:
  std::span<const Aabb> still_;
};

}  // namespace

BroadPhaseMethod bruteForce() {
  return {"brute force", BroadPhaseMethod::Kind::approach, 100000, "a tick takes seconds",
          maker<BruteForce>()};
}

}  // namespace enfilade::benchmarks
