// Broad phase by brute force: every dynamic box against every static box and every other dynamic
// box.
#include "tests/benchmarks/broad_phase_method.hpp"

namespace enfilade::benchmarks {
namespace {

class BruteForce : public BroadPhase {
 public:
  explicit BruteForce(std::span<const Aabb> staticBoxes) : staticBoxes_(staticBoxes) {}

  void runTick(std::span<const Aabb> dynamicBoxes, PairTally& tally) override {
    for (std::uint32_t a = 0; a < dynamicBoxes.size(); ++a) {
      for (std::uint32_t s = 0; s < staticBoxes_.size(); ++s) {
        if (collision::overlaps(dynamicBoxes[a], staticBoxes_[s])) tally.addStaticPair(a, s);
      }
      for (std::uint32_t b = a + 1; b < dynamicBoxes.size(); ++b) {
        if (collision::overlaps(dynamicBoxes[a], dynamicBoxes[b])) tally.addDynamicPair(a, b);
      }
    }
  }

 private:
  std::span<const Aabb> staticBoxes_;
};

}  // namespace

BroadPhaseMethod makeBruteForce() {
  return {"brute force", BroadPhaseMethod::Kind::approach, 100000, "a tick takes seconds",
          bindMaker<BruteForce>()};
}

}  // namespace enfilade::benchmarks
