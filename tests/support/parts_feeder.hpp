// A vibrating tray with small convex parts, for a test and for a benchmark. Lin 1993, section 5.4:
// "thousands of small mechanical parts on a vibrating parts feeder in real time".
#pragma once

#include <deque>
#include <vector>

#include "collision/bounds/bounding_box.hpp"
#include "collision/broad_phase/sort_and_sweep.hpp"
#include "collision/shapes/hull.hpp"
#include "scene/base/thread_pool.hpp"
#include "scene/physics/physics_step.hpp"
#include "scene/physics/physics_world.hpp"

namespace enfilade::testing {

using collision::Hull;
using collision::Quat;
using collision::Vec3;

/// Engine-independent description of the simulation. Metres, seconds. The tray's floor is at y = 0
/// at phase 0 of the drive; the tray is open above and centred on the origin.
struct FeederPlan {
  struct Part {
    std::size_t kind;  ///< index into `kinds`
    Vec3 at;           ///< of the kind's origin, its centre of mass up to a tenth of its size
    Quat rotation;
  };
  std::vector<std::vector<Vec3>> kinds;  ///< vertices of each kind
  std::vector<Part> parts;
  std::vector<std::array<Vec3, 2>> tray;  ///< boxes, min and max: the floor, four walls
  double inner = 0;                       ///< half the inner width
  double wall = 0;                        ///< height of the walls
  double density = 2700;                  ///< aluminium, kg / m^3
  double friction = 0.4;
  int substeps = 4;           ///< per tick of 1/60 s
  int looks = 1;              ///< contact updates per tick; divides `substeps`
  double frequency = 15;      ///< of the drive, Hz: at most an eighth of the substeps'
  double amplitude = 2e-3;    ///< upwards: 1.8 times gravity
  double sidewards = 0.5e-3;  ///< along x, in phase with `amplitude`
};

/// Makes `count` parts of five kinds of about 2 cm, scattered above a tray that holds about two
/// layers of them.
FeederPlan planFeeder(std::size_t count, unsigned seed);

/// The tray's displacement from its rest position at a time; 0 with the drive off.
Vec3 computeTrayPosition(const FeederPlan& plan, double time, bool driven);

/// Maximum penetration over all parts and the tray's boxes in metres, by the exact verdict.
struct FeederFindings {
  double deepest = 0;
  std::size_t penetrating = 0;  ///< pairs
  std::size_t outside = 0;      ///< parts whose centre is outside the tray
};
struct PlacedPart {
  Vec3 position;  ///< of the kind's origin
  Quat rotation;
};
class FeederCheck {
 public:
  explicit FeederCheck(const FeederPlan& plan);
  FeederFindings evaluate(const std::vector<PlacedPart>& parts, const Vec3& tray) const;

 private:
  const FeederPlan& plan_;
  std::vector<Hull> kinds_, tray_;
};

/// The parts feeder, simulated by our engine.
class Feeder {
 public:
  explicit Feeder(const FeederPlan& plan, int threads = 1);
  void tick(bool driven);
  std::vector<PlacedPart> getParts() const;
  Vec3 getTrayPosition() const;
  double computeEnergy()
      const;  ///< energy of the parts, J; potential energy is relative to height 0
  const scene::StepReport& getReport() const { return report_; }  ///< counts summed over substeps
  scene::PhysicsWorld& getDynamics() { return dynamics_; }
  scene::StepSettings& getSettings() { return settings_; }

 private:
  void moveBoxes(double lookout);
  void findMet(std::size_t i, double lookout);
  void findPairs();

  const FeederPlan& plan_;
  std::deque<Hull> hulls_;
  scene::PhysicsWorld dynamics_;
  scene::ThreadPool workers_;
  scene::StepSettings settings_;
  scene::StepReport report_;
  collision::SortAndSweep broadPhase_;
  std::vector<collision::ProxyId> partProxies_;  ///< proxies of the parts
  std::vector<collision::Aabb> boxes_;           ///< of the parts, in the broad phase
  std::vector<collision::Aabb> needed_;          ///< of the parts, exact in this tick
  std::vector<scene::MotionSphere> spheres_;     ///< of all bodies
  std::vector<std::vector<std::uint32_t>> met_;  ///< for each part: the later ones that it may
                                                 ///< touch
  std::vector<std::uint32_t> solidOfMover_, partOfMover_;
  double time_ = 0;
};

}  // namespace enfilade::testing
