// Peer: ODE's sweep-and-prune and hash spaces; category bits exclude static pairs. ODE sorts or
// rehashes a space at each query. Boxes are made from a centre and sizes, so their bounds may
// differ from the given ones by a rounding. The callback tests the given ones.
#include <ode/ode.h>

#include "tests/benchmarks/broad_phase_method.hpp"

namespace enfilade::benchmarks {
namespace {

struct PairQuery {
  std::span<const Aabb> staticBoxes, dynamicBoxes;
  PairTally* tally;
};

std::uintptr_t getTag(dGeomID geom) {
  return reinterpret_cast<std::uintptr_t>(dGeomGetData(geom));
}

void reportPairs(void* data, dGeomID first, dGeomID second) {
  const PairQuery& query = *static_cast<PairQuery*>(data);
  std::uintptr_t a = getTag(first);
  std::uintptr_t b = getTag(second);
  if (a % 2 == 0) std::swap(a, b);
  const auto dynamicBox = static_cast<std::uint32_t>(a / 2);
  const auto other = static_cast<std::uint32_t>(b / 2);
  const bool moves = b % 2 == 1;
  if (!collision::overlaps(query.dynamicBoxes[dynamicBox],
                           moves ? query.dynamicBoxes[other] : query.staticBoxes[other])) {
    return;
  }
  if (moves) query.tally->addDynamicPair(dynamicBox, other);
  if (!moves) query.tally->addStaticPair(dynamicBox, other);
}

class OdeSpace : public BroadPhase {
 public:
  OdeSpace(std::span<const Aabb> staticBoxes, bool hashed) : staticBoxes_(staticBoxes) {
    static const int started = dInitODE2(0);
    (void)started;
    space_ = hashed ? dHashSpaceCreate(nullptr) : dSweepAndPruneSpaceCreate(nullptr, dSAP_AXES_XZY);
    for (std::size_t k = 0; k < staticBoxes.size(); ++k) add(staticBoxes[k], 2 * k, 1, 2);
  }
  ~OdeSpace() override { dSpaceDestroy(space_); }
  OdeSpace(const OdeSpace&) = delete;
  OdeSpace& operator=(const OdeSpace&) = delete;

  void runTick(std::span<const Aabb> dynamicBoxes, PairTally& tally) override {
    for (std::size_t k = 0; k < dynamicBoxes.size(); ++k) {
      if (dynamicBoxes_.size() < dynamicBoxes.size()) {
        dynamicBoxes_.push_back(add(dynamicBoxes[k], 2 * k + 1, 2, 3));
      } else {
        place(dynamicBoxes_[k], dynamicBoxes[k]);
      }
    }
    PairQuery query{staticBoxes_, dynamicBoxes, &tally};
    dSpaceCollide(space_, &query, reportPairs);
  }

 private:
  /// Inflated by more than the rounding of centre and sizes, so that no pair is lost.
  static void place(dGeomID geom, const Aabb& box) {
    const Vec3 centre = box.centre();
    const Vec3 size = box.size() + Vec3::Constant(1e-9);
    dGeomBoxSetLengths(geom, size.x(), size.y(), size.z());
    dGeomSetPosition(geom, centre.x(), centre.y(), centre.z());
  }
  dGeomID add(const Aabb& box, std::uintptr_t tag, unsigned long category, unsigned long collides) {
    dGeomID geom = dCreateBox(space_, 1, 1, 1);
    place(geom, box);
    dGeomSetData(geom, reinterpret_cast<void*>(tag));
    dGeomSetCategoryBits(geom, category);
    dGeomSetCollideBits(geom, collides);
    return geom;
  }

  std::span<const Aabb> staticBoxes_;
  dSpaceID space_;
  std::vector<dGeomID> dynamicBoxes_;
};

}  // namespace

std::vector<BroadPhaseMethod> makeOdeSpaces() {
  const std::string reason = "every tick goes over all static boxes";
  return {
      {"ODE sweep and prune", BroadPhaseMethod::Kind::peer, 10000, reason,
       bindMaker<OdeSpace>(false)},
      {"ODE hash space", BroadPhaseMethod::Kind::peer, 10000, reason, bindMaker<OdeSpace>(true)}};
}

}  // namespace enfilade::benchmarks
