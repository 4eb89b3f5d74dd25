// FCL: dynamic tree of boxes, and sweep and prune (SSaP), each with one manager for the still scene
// and one for the movers, so that still boxes are not on the path of a tick.
#include <fcl/broadphase/broadphase_SSaP.h>
#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl/geometry/shape/box.h>

#include "tests/benchmarks/broad_phase_method.hpp"

namespace enfilade::benchmarks {
namespace {

using Object = fcl::CollisionObjectd;

/// FCL makes an object's box from its shape; here the box itself is given.
void setBox(Object& object, const Box& box) {
  fcl::AABBd& aabb = const_cast<fcl::AABBd&>(object.getAABB());
  aabb.min_ = box.min;
  aabb.max_ = box.max;
}

struct Asked {
  std::span<const Box> still, movers;
  PairTally* tally;
};

/// An object's owner is an integer in a pointer: 2 * id, and 1 for movers.
std::uintptr_t tagOf(const Object& object) {
  return reinterpret_cast<std::uintptr_t>(object.getUserData());
}

bool tell(Object* first, Object* second, void* data) {
  const Asked& asked = *static_cast<Asked*>(data);
  std::uintptr_t a = tagOf(*first);
  std::uintptr_t b = tagOf(*second);
  if (a % 2 == 0) std::swap(a, b);
  const auto mover = static_cast<std::uint32_t>(a / 2);
  const auto other = static_cast<std::uint32_t>(b / 2);
  const bool moves = b % 2 == 1;
  if (!collision::overlaps(asked.movers[mover], moves ? asked.movers[other] : asked.still[other])) {
    return false;
  }
  if (moves) asked.tally->addMovers(mover, other);
  if (!moves) asked.tally->addStill(mover, other);
  return false;  // go on
}

template <typename Manager>
class FclPairs : public BroadPhase {
 public:
  explicit FclPairs(std::span<const Box> still)
      : still_(still), shape_(std::make_shared<fcl::Boxd>(1, 1, 1)) {
    for (std::size_t k = 0; k < still.size(); ++k) add(still[k], 2 * k, stillObjects_);
    stillManager_.registerObjects(pointers(stillObjects_));
    stillManager_.setup();
  }

  void tick(std::span<const Box> movers, PairTally& tally) override {
    if (moverObjects_.empty()) {
      for (std::size_t k = 0; k < movers.size(); ++k) add(movers[k], 2 * k + 1, moverObjects_);
      moverManager_.registerObjects(pointers(moverObjects_));
      moverManager_.setup();
    } else {
      for (std::size_t k = 0; k < movers.size(); ++k) setBox(*moverObjects_[k], movers[k]);
      moverManager_.update();
    }
    Asked asked{still_, movers, &tally};
    moverManager_.collide(&stillManager_, &asked, tell);
    moverManager_.collide(&asked, tell);
  }

 private:
  using Objects = std::vector<std::unique_ptr<Object>>;

  void add(const Box& box, std::uintptr_t tag, Objects& objects) {
    objects.push_back(std::make_unique<Object>(shape_));
    objects.back()->setUserData(reinterpret_cast<void*>(tag));
    setBox(*objects.back(), box);
  }
  static std::vector<Object*> pointers(const Objects& objects) {
    std::vector<Object*> result;
    for (const auto& object : objects) result.push_back(object.get());
    return result;
  }

  std::span<const Box> still_;
  std::shared_ptr<fcl::Boxd> shape_;
  Objects stillObjects_, moverObjects_;
  Manager stillManager_, moverManager_;
};

}  // namespace

std::vector<BroadPhaseMethod> fclBroadPhases() {
  return {{"FCL dynamic tree", BroadPhaseMethod::Kind::peer, SIZE_MAX, "",
           maker<FclPairs<fcl::DynamicAABBTreeCollisionManagerd>>()},
          {"FCL SSaP", BroadPhaseMethod::Kind::peer, 10000,
           "a mover is compared with all that begins near it on one axis",
           maker<FclPairs<fcl::SSaPCollisionManagerd>>()}};
}

}  // namespace enfilade::benchmarks
