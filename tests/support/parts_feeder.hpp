// A vibrating tray with small convex parts (the seed's 5.4: "thousands of small mechanical parts on
// a vibrating parts feeder in real time"), for a test and for a benchmark.
#pragma once

#include <deque>
#include <vector>

#include "collision/bounds/bounding_box.hpp"
#include "collision/broad_phase/sort_and_sweep.hpp"
#include "collision/shapes/hull.hpp"
#include "scene/physics/physics_world.hpp"
#include "scene/physics/thread_pool.hpp"

namespace enfilade::testing {

using collision::Hull;
using collision::Quat;
using collision::Vec3;

/// What is simulated, in no engine's words. Metres, seconds; the tray's floor is at y = 0 where the
/// drive's sine is 0; the tray is open above and its middle is the origin.
struct FeederPlan {
  struct Part {
    std::size_t kind;  ///< of `kinds`
    Vec3 at;           ///< of the kind's origin, its centre of mass up to a tenth of its size
    Quat rotation;
  };
  std::vector<std::vector<Vec3>> kinds;  ///< corners
  std::vector<Part> parts;
  std::vector<std::array<Vec3, 2>> tray;  ///< boxes, min and max: the floor, four walls
  double inner = 0;                       ///< half the inner width
  double wall = 0;                        ///< height of the walls
  double density = 2700;                  ///< aluminium, kg / m^3
  double friction = 0.4;
  int substeps = 4;           ///< of a tick of 1/60 s
  int looks = 1;              ///< a tick: how often contacts are found; divides `substeps`
  double frequency = 15;      ///< of the drive, Hz: at most an eighth of the substeps'
  double amplitude = 2e-3;    ///< upwards: 1.8 times the weight
  double sidewards = 0.5e-3;  ///< along x, in phase
};

/// `count` parts of five kinds some 2 cm long, strewn above a tray of about two layers of them.
FeederPlan planFeeder(std::size_t count, unsigned seed);

/// Where the tray is at a time, from its middle place; 0 with the drive off.
Vec3 trayAt(const FeederPlan& plan, double time, bool driven);

/// Metres that the deepest two of all parts and the tray's boxes penetrate, by the exact verdict.
struct FeederJudgement {
  double deepest = 0;
  std::size_t penetrating = 0;  ///< pairs
  std::size_t outside = 0;      ///< parts whose middle is not in the tray
};
struct PlacedPart {
  Vec3 position;  ///< of the kind's origin
  Quat rotation;
};
class FeederJudge {
 public:
  explicit FeederJudge(const FeederPlan& plan);
  FeederJudgement judge(const std::vector<PlacedPart>& parts, const Vec3& tray) const;

 private:
  const FeederPlan& plan_;
  std::vector<Hull> kinds_, tray_;
};

/// Ours.
class Feeder {
 public:
  explicit Feeder(const FeederPlan& plan, int threads = 1);
  void tick(bool driven);
  std::vector<PlacedPart> parts() const;
  Vec3 tray() const;
  double energy() const;  ///< J, of the parts; potential energy above height 0
  const scene::DynamicsReport& report() const { return report_; }  ///< counts summed over substeps
  scene::Dynamics& dynamics() { return dynamics_; }
  scene::DynamicsStep& settings() { return settings_; }

 private:
  void moveBoxes(double lookout);
  void findMet(std::size_t i, double lookout);
  void findPairs();

  const FeederPlan& plan_;
  std::deque<Hull> hulls_;
  scene::Dynamics dynamics_;
  scene::Workers workers_;
  scene::DynamicsStep settings_;
  scene::DynamicsReport report_;
  collision::SortAndSweep broadPhase_;
  std::vector<collision::MoverId> movers_;  ///< of the parts
  std::vector<collision::ExtremalVertices> extremes_;
  std::vector<collision::Box> boxes_;            ///< of the parts, as the broad phase has them
  std::vector<collision::Box> needed_;           ///< of the parts, in this tick
  std::vector<scene::ReachSphere> spheres_;      ///< of all solids
  std::vector<std::vector<std::uint32_t>> met_;  ///< of each part: those after it that it may meet
  std::vector<std::uint32_t> solidOfMover_, partOfMover_;
  double time_ = 0;
};

}  // namespace enfilade::testing
