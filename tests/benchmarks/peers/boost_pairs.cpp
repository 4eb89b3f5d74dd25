// Peer: Boost.Geometry, with a packed R-tree of the static boxes and a new one of the dynamic boxes
// every tick.
#include <boost/geometry.hpp>
#include <boost/geometry/index/rtree.hpp>

#include "tests/benchmarks/broad_phase_method.hpp"

namespace enfilade::benchmarks {
namespace {

namespace bgi = boost::geometry::index;

class BoostRtree : public BroadPhase {
 public:
  explicit BoostRtree(std::span<const Aabb> staticBoxes) : staticBoxes_(makeValues(staticBoxes)) {}

  void runTick(std::span<const Aabb> dynamicBoxes, PairTally& tally) override {
    const Tree moving(makeValues(dynamicBoxes));
    for (std::uint32_t id = 0; id < dynamicBoxes.size(); ++id) {
      const BoostBox box = toBoostBox(dynamicBoxes[id]);
      for (auto hit = staticBoxes_.qbegin(bgi::intersects(box)); hit != staticBoxes_.qend();
           ++hit) {
        tally.addStaticPair(id, hit->second);
      }
      for (auto hit = moving.qbegin(bgi::intersects(box)); hit != moving.qend(); ++hit) {
        if (id < hit->second) tally.addDynamicPair(id, hit->second);
      }
    }
  }
  bool readsGivenBoxes() const override { return false; }

 private:
  using Point = boost::geometry::model::point<double, 3, boost::geometry::cs::cartesian>;
  using BoostBox = boost::geometry::model::box<Point>;
  using Value = std::pair<BoostBox, std::uint32_t>;
  using Tree = bgi::rtree<Value, bgi::rstar<16>>;

  static BoostBox toBoostBox(const Aabb& b) {
    return {Point(b.min.x(), b.min.y(), b.min.z()), Point(b.max.x(), b.max.y(), b.max.z())};
  }
  static std::vector<Value> makeValues(std::span<const Aabb> boxes) {
    std::vector<Value> result;
    for (std::uint32_t k = 0; k < boxes.size(); ++k) result.emplace_back(toBoostBox(boxes[k]), k);
    return result;
  }

  Tree staticBoxes_;
};

}  // namespace

BroadPhaseMethod makeBoostRtree() {
  return {"Boost R-tree", BroadPhaseMethod::Kind::peer, SIZE_MAX, "", bindMaker<BoostRtree>()};
}

}  // namespace enfilade::benchmarks
