#include "tests/benchmarks/broad_phase_method.hpp"

namespace enfilade::benchmarks {
namespace {

class OurSortAndSweep : public BroadPhase {
 public:
  explicit OurSortAndSweep(std::span<const Aabb> staticBoxes) : sweep_(staticBoxes) {}

  void runTick(std::span<const Aabb> dynamicBoxes, PairTally& tally) override {
    for (std::uint32_t id = 0; id < dynamicBoxes.size(); ++id) {
      if (inserted_) {
        sweep_.move(id, dynamicBoxes[id]);
      } else {
        sweep_.insert(dynamicBoxes[id]);
      }
    }
    inserted_ = true;
    sweep_.update();
    for (std::uint32_t id = 0; id < dynamicBoxes.size(); ++id) {
      for (const auto& partner : sweep_.getOverlaps(id)) {
        if (!partner.isDynamic) tally.addStaticPair(id, partner.id);
        if (partner.isDynamic && id < partner.id) tally.addDynamicPair(id, partner.id);
      }
    }
  }
  bool readsGivenBoxes() const override { return false; }

 private:
  collision::SortAndSweep sweep_;
  bool inserted_ = false;
};

[[maybe_unused]] void append(std::vector<BroadPhaseMethod>& to,
                             std::vector<BroadPhaseMethod> some) {
  for (BroadPhaseMethod& method : some) to.push_back(std::move(method));
}

}  // namespace

BroadPhaseMethod makeOurSortAndSweep() {
  return {"ours: sort and sweep", BroadPhaseMethod::Kind::ours, SIZE_MAX, "",
          bindMaker<OurSortAndSweep>()};
}

std::vector<BroadPhaseMethod> makeBroadPhaseMethods() {
  std::vector<BroadPhaseMethod> all{makeOurSortAndSweep(), makeHashGrid(),     makeLooseOctree(),
                                    makeBspTree(),         makeIntervalTree(), makeBruteForce()};
#ifdef BENCH_BOOST
  all.push_back(makeBoostRtree());
#endif
#ifdef BENCH_BULLET
  append(all, makeBulletBroadPhases());
#endif
#ifdef BENCH_BULLETFLOAT
  append(all, makeFloatBulletBroadPhases());
#endif
#ifdef BENCH_EMBREE
  all.push_back(makeEmbreeBvh());
#endif
#ifdef BENCH_FCL
  append(all, makeFclBroadPhases());
#endif
#ifdef BENCH_ODE
  append(all, makeOdeSpaces());
#endif
#ifdef BENCH_CGAL
  all.push_back(makeCgalBoxes());
#endif
  return all;
}

}  // namespace enfilade::benchmarks
