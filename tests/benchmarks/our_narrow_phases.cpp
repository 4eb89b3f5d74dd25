// Our narrow phase at its two levels, and at the exact level with the solver's depth.
#include "collision/narrow_phase/narrow_phase.hpp"
#include "collision/narrow_phase/penetration_depth.hpp"
#include "collision/narrow_phase/refine.hpp"
#include "collision/shapes/hull.hpp"
#include "tests/benchmarks/narrow_phase_method.hpp"

namespace enfilade::benchmarks {
namespace {

using collision::Hull;
using collision::PlacedConvex;
using collision::Verdict;

class OurPair : public PairOfBodies {
 public:
  OurPair(const Points& a, const Points& b)
      : hullA_(collision::buildHull(a)), hullB_(collision::buildHull(b)) {}
  void forget() override { features_ = {}; }

 protected:
  static PlacedConvex makeBody(const Hull& hull, const RigidTransform& at) {
    return {hull.vertices, at.translation, &at.rotation, &hull};
  }
  Hull hullA_, hullB_;
  collision::FeatureCache features_;
};

class Decides : public OurPair {
 public:
  using OurPair::OurPair;
  Answer ask(const RigidTransform& a, const RigidTransform& b) override {
    const auto result =
        collision::computeSeparation(makeBody(hullA_, a), makeBody(hullB_, b), features_);
    Answer answer = result.verdict == Verdict::separated ? makeApart(result.distance) : collides();
    answer.decidedBy = static_cast<std::int8_t>(result.certificate);
    return answer;
  }
};

class DecidesWithDepth : public OurPair {
 public:
  using OurPair::OurPair;
  Answer ask(const RigidTransform& a, const RigidTransform& b) override {
    const PlacedConvex bodyA = makeBody(hullA_, a);
    const PlacedConvex bodyB = makeBody(hullB_, b);
    const auto result = collision::computeSeparation(bodyA, bodyB, features_);
    Answer answer = result.verdict == Verdict::separated ? makeApart(result.distance) : collides(0);
    answer.decidedBy = static_cast<std::int8_t>(result.certificate);
    if (result.verdict == Verdict::penetrating) {
      const auto depth = collision::computePenetrationDepth(bodyA, bodyB, features_, depth_);
      answer.depth = depth.depth;
      answer.depthProved = depth.global;
    }
    return answer;
  }
  void forget() override {
    OurPair::forget();
    depth_ = {};
  }

 private:
  collision::DepthCache depth_;
};

class Refines : public OurPair {
 public:
  using OurPair::OurPair;
  Answer ask(const RigidTransform& a, const RigidTransform& b) override {
    const auto result =
        collision::refineSeparation(makeBody(hullA_, a), makeBody(hullB_, b), features_);
    Answer answer = result.verdict == Verdict::separated ? makeApart(result.distance)
                                                         : collides(result.penetration);
    answer.decidedBy = static_cast<std::int8_t>(result.certificate);
    return answer;
  }
};

template <typename Method>
std::unique_ptr<PairOfBodies> make(const Points& a, const Points& b) {
  return std::make_unique<Method>(a, b);
}

}  // namespace

std::vector<NarrowPhaseMethod> makeOurNarrowPhases() {
  return {{"ours: decide", true, "decide", true, true, false, make<Decides>},
          {"ours: decide with depth", true, "decide", true, true, true, make<DecidesWithDepth>},
          {"ours: refine", true, "refine", true, true, true, make<Refines>}};
}

}  // namespace enfilade::benchmarks
