// Interface of every benchmarked narrow phase.
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "collision/motion/rigid_motion.hpp"

namespace enfilade::benchmarks {

using collision::Mat3;
using collision::Vec3;
using Points = std::vector<Vec3>;

/// Its doubles are taken as exact.
using collision::RigidTransform;

struct Answer {
  enum class Verdict : std::uint8_t {
    apart,
    collides,  ///< touching counts
    none       ///< it threw, gave up, returned NaN, or died
  } verdict = Verdict::none;
  std::int8_t decidedBy = -1;  ///< ours: collision::Certificate; others: -1
  double distance = std::numeric_limits<double>::quiet_NaN();  ///< metres; NaN: not reported
  double depth = std::numeric_limits<double>::quiet_NaN();
  bool depthProved = true;  ///< ours: false for an upper bound
};

inline Answer makeApart(double distance) {
  Answer answer;
  if (!std::isfinite(distance)) return answer;
  answer.verdict = Answer::Verdict::apart;
  answer.distance = distance;
  return answer;
}
inline Answer collides(double depth = std::numeric_limits<double>::quiet_NaN()) {
  Answer answer;
  answer.verdict = Answer::Verdict::collides;
  answer.depth = depth;
  return answer;
}

/// A pair of bodies, with the method's state cached between queries.
class PairOfBodies {
 public:
  virtual ~PairOfBodies() = default;
  virtual Answer ask(const RigidTransform& a, const RigidTransform& b) = 0;
  /// Makes the next query a cold one.
  virtual void forget() {}
};

struct NarrowPhaseMethod {
  std::string name;
  bool ours;
  std::string level;  ///< ours: "decide" or "refine"; peers: the kind of query
  bool warm;          ///< keeps state between queries
  bool distance, depth;
  std::function<std::unique_ptr<PairOfBodies>(const Points& a, const Points& b)> make;
};

/// All methods, ours first.
std::vector<NarrowPhaseMethod> makeNarrowPhaseMethods();

// Factories, one per source file.
std::vector<NarrowPhaseMethod> makeOurNarrowPhases();
std::vector<NarrowPhaseMethod> makeBulletConvexMethods();
std::vector<NarrowPhaseMethod> makeCcdConvexMethods();
std::vector<NarrowPhaseMethod> makeCgalConvexMethods();
std::vector<NarrowPhaseMethod> makeFclConvexMethods();
std::vector<NarrowPhaseMethod> makeOdeConvexMethods();

}  // namespace enfilade::benchmarks
