// Peer: CGAL's intersection of two sequences of boxes (Zomorodian and Edelsbrunner 2002), computed
// from scratch every tick.
#include <CGAL/box_intersection_d.h>

#include "tests/benchmarks/broad_phase_method.hpp"

namespace enfilade::benchmarks {
namespace {

class CgalBoxes : public BroadPhase {
 public:
  explicit CgalBoxes(std::span<const Aabb> still) { fill(still, still_); }

  void tick(std::span<const Aabb> movers, PairTally& tally) override {
    movers_.clear();
    fill(movers, movers_);
    CGAL::box_intersection_d(
        movers_.begin(), movers_.end(), still_.begin(), still_.end(),
        [&](const Handled& a, const Handled& b) { tally.addStill(a.number, b.number); });
    CGAL::box_self_intersection_d(
        movers_.begin(), movers_.end(),
        [&](const Handled& a, const Handled& b) { tally.addMovers(a.number, b.number); });
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

  std::vector<Handled> still_, movers_;
};

}  // namespace

BroadPhaseMethod cgalBoxes() {
  return {"CGAL box intersection", BroadPhaseMethod::Kind::peer, 100000,
          "every tick goes over all still boxes", maker<CgalBoxes>()};
}

}  // namespace enfilade::benchmarks
