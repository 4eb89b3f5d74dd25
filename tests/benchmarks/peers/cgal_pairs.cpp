// Peer: CGAL's intersection of two sequences of boxes (Zomorodian and Edelsbrunner 2002), computed
// from scratch every tick.
#include <CGAL/box_intersection_d.h>

#include "tests/benchmarks/broad_phase_method.hpp"

namespace enfilade::benchmarks {
namespace {

class CgalBoxes : public BroadPhase {
 public:
  explicit CgalBoxes(std::span<const Aabb> staticBoxes) { fill(staticBoxes, staticBoxes_); }

  void runTick(std::span<const Aabb> dynamicBoxes, PairTally& tally) override {
    dynamicBoxes_.clear();
    fill(dynamicBoxes, dynamicBoxes_);
    CGAL::box_intersection_d(
        dynamicBoxes_.begin(), dynamicBoxes_.end(), staticBoxes_.begin(), staticBoxes_.end(),
        [&](const Handled& a, const Handled& b) { tally.addStaticPair(a.number, b.number); });
    CGAL::box_self_intersection_d(
        dynamicBoxes_.begin(), dynamicBoxes_.end(),
        [&](const Handled& a, const Handled& b) { tally.addDynamicPair(a.number, b.number); });
  }
  bool readsGivenBoxes() const override { return false; }

 private:
  struct Handled : CGAL::Box_intersection_d::Box_d<double, 3> {
    Handled(const Aabb& box, std::uint32_t id) : number(id) {
      std::array<double, 3> low{box.min.x(), box.min.y(), box.min.z()};
      std::array<double, 3> high{box.max.x(), box.max.y(), box.max.z()};
      extend(low.data());
      extend(high.data());
    }
    std::uint32_t number;
  };

  static void fill(std::span<const Aabb> boxes, std::vector<Handled>& to) {
    for (std::uint32_t k = 0; k < boxes.size(); ++k) to.emplace_back(boxes[k], k);
  }

  std::vector<Handled> staticBoxes_, dynamicBoxes_;
};

}  // namespace

BroadPhaseMethod makeCgalBoxes() {
  return {"CGAL box intersection", BroadPhaseMethod::Kind::peer, 100000,
          "every tick goes over all static boxes", bindMaker<CgalBoxes>()};
}

}  // namespace enfilade::benchmarks
