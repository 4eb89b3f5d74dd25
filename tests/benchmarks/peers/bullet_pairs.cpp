// Peer: Bullet's dynamic AABB tree (Dbvt) and its 32-bit axis sweep. In doubles, and compiled a
// second time as a module in floats (bulletfloat_pairs.cpp), with boxes rounded outwards.
//
// Both cache pairs whose fattened or quantized boxes overlap; pairs with overlapping exact boxes
// are reported. Filter groups exclude static pairs. Dbvt needs about a hundred ticks to move static
// boxes into its fixed tree and to balance it. These run at construction and count as building.
#include <BulletCollision/BroadphaseCollision/btAxisSweep3.h>
#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>

#include <cmath>
#include <limits>

#include "tests/benchmarks/broad_phase_method.hpp"

namespace enfilade::benchmarks {
namespace {

constexpr int kSettlingTicks = 110;
constexpr int kStaticGroup = 1, kDynamicGroup = 2;

btVector3 roundDown(const Vec3& v) {
  const auto down = [](double x) {
    const auto rounded = static_cast<btScalar>(x);
    return static_cast<double>(rounded) > x
               ? std::nextafter(rounded, -std::numeric_limits<btScalar>::infinity())
               : rounded;
  };
  return {down(v.x()), down(v.y()), down(v.z())};
}

btVector3 roundUp(const Vec3& v) {
  return -roundDown(-v);
}

/// A proxy's user pointer holds an integer: 2 * id, plus 1 for dynamic boxes.
std::uintptr_t getTag(const btBroadphaseProxy& proxy) {
  return reinterpret_cast<std::uintptr_t>(proxy.m_clientObject);
}

class BulletPairs : public BroadPhase {
 public:
  BulletPairs(std::span<const Aabb> staticBoxes, bool axisSweep) : staticBoxes_(staticBoxes) {
    Aabb world;
    for (const Aabb& box : staticBoxes) world.include(box);
    world = collision::inflate(world, 10);
    const std::size_t maxDynamicBoxes =
        staticBoxes.size() < 100 ? 100'000 : 2'000;  // or everything moves
    if (axisSweep) {
      broadphase_ = std::make_unique<bt32BitAxisSweep3>(
          roundDown(world.min), roundUp(world.max),
          static_cast<unsigned>(staticBoxes.size() + maxDynamicBoxes), nullptr, true);
    } else {
      broadphase_ = std::make_unique<btDbvtBroadphase>();
    }
    for (std::size_t k = 0; k < staticBoxes.size(); ++k)
      add(staticBoxes[k], 2 * k, kStaticGroup, kDynamicGroup);
    for (int k = 0; k < kSettlingTicks; ++k) broadphase_->calculateOverlappingPairs(nullptr);
  }
  ~BulletPairs() override {
    for (btBroadphaseProxy* proxy : proxies_) broadphase_->destroyProxy(proxy, nullptr);
  }
  BulletPairs(const BulletPairs&) = delete;
  BulletPairs& operator=(const BulletPairs&) = delete;

  void runTick(std::span<const Aabb> dynamicBoxes, PairTally& tally) override {
    if (proxies_.size() == staticBoxes_.size()) {
      for (std::size_t k = 0; k < dynamicBoxes.size(); ++k) {
        add(dynamicBoxes[k], 2 * k + 1, kDynamicGroup, kStaticGroup | kDynamicGroup);
      }
    } else {
      for (std::size_t k = 0; k < dynamicBoxes.size(); ++k) {
        broadphase_->setAabb(proxies_[staticBoxes_.size() + k], roundDown(dynamicBoxes[k].min),
                             roundUp(dynamicBoxes[k].max), nullptr);
      }
    }
    broadphase_->calculateOverlappingPairs(nullptr);
    reportPairs(dynamicBoxes, tally);
  }

 private:
  void add(const Aabb& box, std::uintptr_t tag, int group, int mask) {
    proxies_.push_back(broadphase_->createProxy(roundDown(box.min), roundUp(box.max), 0,
                                                reinterpret_cast<void*>(tag), group, mask,
                                                nullptr));
  }

  void reportPairs(std::span<const Aabb> dynamicBoxes, PairTally& tally) const {
    const btBroadphasePairArray& pairs =
        broadphase_->getOverlappingPairCache()->getOverlappingPairArray();
    for (int k = 0; k < pairs.size(); ++k) {
      std::uintptr_t a = getTag(*pairs[k].m_pProxy0);
      std::uintptr_t b = getTag(*pairs[k].m_pProxy1);
      if (a % 2 == 0) std::swap(a, b);
      const auto dynamicBox = static_cast<std::uint32_t>(a / 2);
      const auto other = static_cast<std::uint32_t>(b / 2);
      const bool moves = b % 2 == 1;
      if (!collision::overlaps(dynamicBoxes[dynamicBox],
                               moves ? dynamicBoxes[other] : staticBoxes_[other]))
        continue;
      if (moves) tally.addDynamicPair(dynamicBox, other);
      if (!moves) tally.addStaticPair(dynamicBox, other);
    }
  }

  std::span<const Aabb> staticBoxes_;
  std::unique_ptr<btBroadphaseInterface> broadphase_;
  std::vector<btBroadphaseProxy*> proxies_;  ///< static ones, then dynamic boxes
};

}  // namespace

#ifdef BT_USE_DOUBLE_PRECISION
std::vector<BroadPhaseMethod> makeBulletBroadPhases() {
  const std::string precision;
#else
extern "C" __attribute__((visibility("default"))) std::vector<BroadPhaseMethod>*
makeBulletFloatBroadPhases() {
  const std::string precision = " (float)";
#endif
  const std::vector<BroadPhaseMethod> methods{
      {"Bullet Dbvt" + precision, BroadPhaseMethod::Kind::peer, SIZE_MAX, "",
       bindMaker<BulletPairs>(false)},
      {"Bullet axis sweep" + precision, BroadPhaseMethod::Kind::peer, 10000, "minutes to build",
       bindMaker<BulletPairs>(true), 20000}};
#ifdef BT_USE_DOUBLE_PRECISION
  return methods;
#else
  return new std::vector<BroadPhaseMethod>(methods);
#endif
}

}  // namespace enfilade::benchmarks
