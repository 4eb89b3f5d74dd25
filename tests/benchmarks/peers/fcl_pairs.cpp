// Peer: FCL's dynamic AABB tree and its sweep and prune (SSaP). Each has one manager for the static
// scene and one for the dynamic boxes, so that a tick does not touch static boxes.
#include <fcl/broadphase/broadphase_SSaP.h>
#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl/geometry/shape/box.h>

#include "tests/benchmarks/broad_phase_method.hpp"

namespace enfilade::benchmarks {
namespace {

using Object = fcl::CollisionObjectd;

/// Sets the given box directly; FCL would compute one from the shape.
void setBox(Object& object, const Aabb& box) {
  fcl::AABBd& aabb = const_cast<fcl::AABBd&>(object.getAABB());
  aabb.min_ = box.min;
  aabb.max_ = box.max;
}

struct PairQuery {
  std::span<const Aabb> staticBoxes, dynamicBoxes;
  PairTally* tally;
};

/// An object's user pointer holds an integer: 2 * id, plus 1 for dynamic boxes.
std::uintptr_t getTag(const Object& object) {
  return reinterpret_cast<std::uintptr_t>(object.getUserData());
}

bool reportPairs(Object* first, Object* second, void* data) {
  const PairQuery& query = *static_cast<PairQuery*>(data);
  std::uintptr_t a = getTag(*first);
  std::uintptr_t b = getTag(*second);
  if (a % 2 == 0) std::swap(a, b);
  const auto dynamicBox = static_cast<std::uint32_t>(a / 2);
  const auto other = static_cast<std::uint32_t>(b / 2);
  const bool moves = b % 2 == 1;
  if (!collision::overlaps(query.dynamicBoxes[dynamicBox],
                           moves ? query.dynamicBoxes[other] : query.staticBoxes[other])) {
    return false;
  }
  if (moves) query.tally->addDynamicPair(dynamicBox, other);
  if (!moves) query.tally->addStaticPair(dynamicBox, other);
  return false;  // continue
}

template <typename Manager>
class FclPairs : public BroadPhase {
 public:
  explicit FclPairs(std::span<const Aabb> staticBoxes)
      : staticBoxes_(staticBoxes), shape_(std::make_shared<fcl::Boxd>(1, 1, 1)) {
    for (std::size_t k = 0; k < staticBoxes.size(); ++k) add(staticBoxes[k], 2 * k, staticObjects_);
    staticManager_.registerObjects(getPointers(staticObjects_));
    staticManager_.setup();
  }

  void runTick(std::span<const Aabb> dynamicBoxes, PairTally& tally) override {
    if (dynamicObjects_.empty()) {
      for (std::size_t k = 0; k < dynamicBoxes.size(); ++k)
        add(dynamicBoxes[k], 2 * k + 1, dynamicObjects_);
      dynamicManager_.registerObjects(getPointers(dynamicObjects_));
      dynamicManager_.setup();
    } else {
      for (std::size_t k = 0; k < dynamicBoxes.size(); ++k)
        setBox(*dynamicObjects_[k], dynamicBoxes[k]);
      dynamicManager_.update();
    }
    PairQuery query{staticBoxes_, dynamicBoxes, &tally};
    dynamicManager_.collide(&staticManager_, &query, reportPairs);
    dynamicManager_.collide(&query, reportPairs);
  }

 private:
  using Objects = std::vector<std::unique_ptr<Object>>;

  void add(const Aabb& box, std::uintptr_t tag, Objects& objects) {
    objects.push_back(std::make_unique<Object>(shape_));
    objects.back()->setUserData(reinterpret_cast<void*>(tag));
    setBox(*objects.back(), box);
  }
  static std::vector<Object*> getPointers(const Objects& objects) {
    std::vector<Object*> result;
    for (const auto& object : objects) result.push_back(object.get());
    return result;
  }

  std::span<const Aabb> staticBoxes_;
  std::shared_ptr<fcl::Boxd> shape_;
  Objects staticObjects_, dynamicObjects_;
  Manager staticManager_, dynamicManager_;
};

}  // namespace

std::vector<BroadPhaseMethod> makeFclBroadPhases() {
  return {{"FCL dynamic tree", BroadPhaseMethod::Kind::peer, SIZE_MAX, "",
           bindMaker<FclPairs<fcl::DynamicAABBTreeCollisionManagerd>>()},
          {"FCL SSaP", BroadPhaseMethod::Kind::peer, 10000,
           "a dynamic box is compared with all that begins near it on one axis",
           bindMaker<FclPairs<fcl::SSaPCollisionManagerd>>()}};
}

}  // namespace enfilade::benchmarks
