#include "tests/support/parts_feeder.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include "collision/narrow_phase/penetration_depth.hpp"
#include "tests/scene/physics_scene.hpp"

namespace enfilade::testing {
namespace {

using collision::Aabb;
using collision::Pose;

constexpr double kTick = 1.0 / 60;
constexpr double kGravity = 9.80665;
constexpr double kWallThickness = 0.1;
/// Metres that a part may move in a tick beyond the distance of its own speed.
constexpr double kSpareReach = 5e-3;
constexpr std::size_t kBoxBlock = 32;  // parts that a thread processes at a time
constexpr double kSpareBox = 8e-3;     // metres by which a new box is inflated

std::vector<Vec3> makeBoxCorners(const Vec3& half) {
  std::vector<Vec3> corners;
  for (int i = 0; i < 8; ++i)
    corners.emplace_back((i & 1) ? half.x() : -half.x(), (i & 2) ? half.y() : -half.y(),
                         (i & 4) ? half.z() : -half.z());
  return corners;
}

/// A prism with `sides` sides along y; tapered to `top` of its radius.
std::vector<Vec3> makePrismCorners(int sides, double radius, double halfHeight, double top) {
  std::vector<Vec3> corners;
  for (int i = 0; i < sides; ++i) {
    const double angle = 2 * 3.14159265358979 * i / sides;
    const Vec3 out{radius * std::cos(angle), 0, radius * std::sin(angle)};
    corners.push_back(out - halfHeight * Vec3::UnitY());
    corners.push_back(top * out + halfHeight * Vec3::UnitY());
  }
  return corners;
}

Quat drawRotation(std::mt19937& random) {
  std::normal_distribution<double> number;
  Quat q;  // separate statements: the evaluation order of arguments is unspecified
  for (double* part : {&q.z(), &q.y(), &q.x(), &q.w()}) *part = number(random);
  q.normalize();
  return q;
}

void layTray(FeederPlan& plan) {
  const double in = plan.inner, out = in + kWallThickness, high = plan.wall;
  plan.tray.push_back({Vec3(-out, -kWallThickness, -out), Vec3(out, 0, out)});
  plan.tray.push_back({Vec3(-out, 0, -out), Vec3(-in, high, out)});
  plan.tray.push_back({Vec3(in, 0, -out), Vec3(out, high, out)});
  plan.tray.push_back({Vec3(-in, 0, -out), Vec3(in, high, -in)});
  plan.tray.push_back({Vec3(-in, 0, in), Vec3(in, high, out)});
}

Hull makeHullOfBox(const std::array<Vec3, 2>& box) {
  std::vector<Vec3> corners = makeBoxCorners(0.5 * (box[1] - box[0]));
  for (Vec3& corner : corners) corner += 0.5 * (box[0] + box[1]);
  return collision::buildHull(corners);
}

}  // namespace

FeederPlan planFeeder(std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  FeederPlan plan;
  plan.kinds = {makeBoxCorners({0.010, 0.005, 0.007}), makePrismCorners(6, 0.009, 0.004, 1),
                makePrismCorners(3, 0.010, 0.006, 0.6), makePrismCorners(8, 0.006, 0.010, 0.7),
                makePrismCorners(4, 0.010, 0.003, 0.5)};
  const double spacing = 0.026;
  const auto across =
      static_cast<std::size_t>(std::ceil(std::sqrt(static_cast<double>(count) / 4)));
  plan.inner = 0.5 * spacing * static_cast<double>(across);
  plan.wall = 0.25;
  layTray(plan);
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t row = i % across, column = i / across % across, layer = i / across / across;
    const Vec3 cell(static_cast<double>(row) + 0.5, static_cast<double>(layer) + 0.7,
                    static_cast<double>(column) + 0.5);
    plan.parts.push_back({i % plan.kinds.size(), spacing * cell - Vec3(plan.inner, 0, plan.inner),
                          drawRotation(random)});
  }
  return plan;
}

Vec3 computeTrayPosition(const FeederPlan& plan, double time, bool driven) {
  if (!driven) return Vec3::Zero();
  const double sine = std::sin(2 * 3.14159265358979 * plan.frequency * time);
  return sine * Vec3(plan.sidewards, plan.amplitude, 0);
}

// ---- measurement -------------------------------------------------------------------------------

FeederCheck::FeederCheck(const FeederPlan& plan) : plan_(plan) {
  for (const auto& corners : plan.kinds) kinds_.push_back(collision::buildHull(corners));
  for (const auto& box : plan.tray) tray_.push_back(makeHullOfBox(box));
}

FeederFindings FeederCheck::evaluate(const std::vector<PlacedPart>& parts, const Vec3& tray) const {
  FeederFindings found;
  std::vector<collision::Mat3> rotations;
  collision::SortAndSweep near({});
  for (const PlacedPart& part : parts) rotations.push_back(part.rotation.toRotationMatrix());
  const auto makeBody = [&](std::size_t i) {
    if (i >= parts.size()) {
      const Hull& hull = tray_[i - parts.size()];
      return collision::PlacedConvex{hull.vertices, tray, nullptr, &hull};
    }
    const Hull& hull = kinds_[plan_.parts[i].kind];
    return collision::PlacedConvex{hull.vertices, parts[i].position, &rotations[i], &hull};
  };
  for (std::size_t i = 0; i < parts.size() + tray_.size(); ++i) {
    const auto body = makeBody(i);
    near.insert(collision::computeTightAabb(
        *body.hull, body.rotation ? *body.rotation : collision::Mat3::Identity(),
        body.translation));
  }
  near.update();
  for (const auto& pair : near.addedPairs()) {
    if (pair.proxy >= parts.size() && pair.other >= parts.size()) continue;
    collision::FeatureCache cache;
    const auto a = makeBody(pair.proxy), b = makeBody(pair.other);
    if (collision::computeSeparation(a, b, cache).verdict != collision::Verdict::penetrating)
      continue;
    collision::DepthCache none;
    ++found.penetrating;
    found.deepest =
        std::max(found.deepest, collision::computePenetrationDepth(a, b, cache, none).depth);
  }
  for (const PlacedPart& part : parts) {
    const Vec3 at = part.position - tray;
    const bool inside = std::abs(at.x()) < plan_.inner && std::abs(at.z()) < plan_.inner &&
                        at.y() > 0 && at.y() < 4 * plan_.wall;
    if (!inside) ++found.outside;
  }
  return found;
}

// ---- our engine --------------------------------------------------------------------------------

Feeder::Feeder(const FeederPlan& plan, int threads)
    : plan_(plan), workers_(threads), broadPhase_({}) {
  settings_.pool = &workers_;
  settings_.solver.substeps = plan.substeps / plan.looks;
  settings_.solver.seconds = kTick / plan.looks;
  settings_.solver.iterations = 4;
  std::vector<const Hull*> trayHulls, kinds;
  for (const auto& box : plan.tray)
    hulls_.push_back(makeHullOfBox(box)), trayHulls.push_back(&hulls_.back());
  for (const auto& corners : plan.kinds)
    hulls_.push_back(collision::buildHull(corners)), kinds.push_back(&hulls_.back());
  dynamics_.bodies.push_back(scene::makeKinematicBody(trayHulls, {}));
  for (const FeederPlan::Part& part : plan.parts) {
    const Hull* hull = kinds[part.kind];
    dynamics_.bodies.push_back(
        scene::makeDynamicBody({&hull, 1}, plan.density, {part.rotation, part.at}));
  }
  for (scene::PhysicsBody& solid : dynamics_.bodies) solid.motion.friction = plan.friction;
  boxes_.resize(dynamics_.bodies.size());
  for (std::uint32_t i = 0; i < trayHulls.size(); ++i) {
    const double moves = 2 * (plan.amplitude + plan.sidewards) + 2 * settings_.solver.contactOffset;
    broadPhase_.insert(inflate(Aabb{plan.tray[i][0], plan.tray[i][1]}, moves));
  }
  for (std::size_t i = 1; i < dynamics_.bodies.size(); ++i)
    partProxies_.push_back(broadPhase_.insert({Vec3::Zero(), Vec3::Zero()}));
  // A new broad phase assigns consecutive ids: the tray's boxes first, then the parts.
  for (std::uint32_t i = 0; i < trayHulls.size(); ++i)
    solidOfMover_.push_back(0), partOfMover_.push_back(i);
  for (std::uint32_t i = 1; i < dynamics_.bodies.size(); ++i)
    solidOfMover_.push_back(i), partOfMover_.push_back(0);
}

/// Computes each part's bounds until the next tick, once a tick. The inflated box in the broad
/// phase is moved only when a part leaves it.
void Feeder::moveBoxes(double lookout) {
  needed_.resize(dynamics_.bodies.size());
  workers_.parallelFor(dynamics_.bodies.size(), kBoxBlock, [&](std::size_t from, std::size_t to) {
    for (std::size_t i = std::max(from, std::size_t{1}); i < to; ++i) {
      scene::PhysicsBody& solid = dynamics_.bodies[i];
      solid.maxStepDisplacement =
          solid.asleep ? lookout
                       : solid.maxPointSpeed() * kTick + kGravity * kTick * kTick + kSpareReach;
      needed_[i] = collision::computeTightAabb(*solid.parts[0].hull, solid.rotation, solid.position,
                                               solid.maxStepDisplacement + lookout);
    }
  });
  for (std::size_t i = 1; i < dynamics_.bodies.size(); ++i) {
    if (contains(boxes_[i], needed_[i])) continue;
    boxes_[i] = inflate(needed_[i], kSpareBox);
    broadPhase_.move(partProxies_[i - 1], boxes_[i]);
  }
  broadPhase_.update();
}

/// Parts after part `i` that it may touch.
void Feeder::findMet(std::size_t i, double lookout) {
  met_[i].clear();
  for (const auto& partner : broadPhase_.getOverlaps(partProxies_[i - 1])) {
    const std::uint32_t other = solidOfMover_[partner.id];
    if (other > i && scene::mayMeet(spheres_[i], spheres_[other], lookout))
      met_[i].push_back(other);
  }
}

void Feeder::findPairs() {
  const double lookout = 2 * settings_.solver.contactOffset;
  moveBoxes(lookout);
  const std::uint32_t size = static_cast<std::uint32_t>(dynamics_.bodies.size());
  std::vector<scene::PartPairKey> keys;
  for (std::uint32_t i = 1; i < size; ++i)
    for (const auto& partner : broadPhase_.getOverlaps(partProxies_[i - 1]))
      if (solidOfMover_[partner.id] == 0) keys.push_back({0, i, partOfMover_[partner.id], 0});
  met_.resize(size), spheres_.clear();
  for (const scene::PhysicsBody& solid : dynamics_.bodies)
    spheres_.push_back(scene::computeMotionSphere(solid));
  workers_.parallelFor(size, kBoxBlock, [&](std::size_t from, std::size_t to) {
    for (std::size_t i = std::max(from, std::size_t{1}); i < to; ++i) findMet(i, lookout);
  });
  for (std::uint32_t i = 1; i < size; ++i)
    for (const std::uint32_t other : met_[i]) keys.push_back({i, other, 0, 0});
  if (!std::is_sorted(keys.begin(), keys.end())) std::sort(keys.begin(), keys.end());
  scene::setPairs(dynamics_, keys, &workers_);
}

void Feeder::tick(bool driven) {
  findPairs();
  scene::PhysicsBody& tray = dynamics_.bodies[0];
  std::vector<double> reach;
  for (const scene::PhysicsBody& solid : dynamics_.bodies)
    reach.push_back(solid.accumulatedMotion + solid.maxStepDisplacement);
  report_ = {};
  for (int i = 0; i < plan_.looks; ++i) {
    const double seconds = settings_.solver.seconds;
    for (std::size_t k = 1; k < reach.size(); ++k)
      dynamics_.bodies[k].maxStepDisplacement =
          std::max(0.0, reach[k] - dynamics_.bodies[k].accumulatedMotion);
    const double substep = seconds / settings_.solver.substeps;
    Vec3 at = tray.motion.centre;
    tray.substepVelocities.clear();
    for (int n = 1; driven && n <= settings_.solver.substeps; ++n) {
      const Vec3 next = computeTrayPosition(plan_, time_ + n * substep, driven);
      tray.substepVelocities.push_back({(next - at) / substep, Vec3::Zero()});
      at = next;
    }
    tray.motion.velocity = (at - tray.motion.centre) / seconds;
    const scene::StepReport step = scene::stepPhysics(dynamics_, settings_);
    time_ += seconds;
    report_.awake = step.awake;
    report_.islands = step.islands;
    report_.narrowPhaseQueries += step.narrowPhaseQueries;
    report_.constraints += step.constraints;
    report_.touching += step.touching;
    report_.continuousChecks += step.continuousChecks;
    report_.reducedMotions += step.reducedMotions;
    report_.crushed += step.crushed;
    report_.maxPenetration = std::max(report_.maxPenetration, step.maxPenetration);
  }
}

std::vector<PlacedPart> Feeder::getParts() const {
  std::vector<PlacedPart> placed;
  for (std::size_t i = 1; i < dynamics_.bodies.size(); ++i)
    placed.push_back({dynamics_.bodies[i].position, dynamics_.bodies[i].motion.rotation});
  return placed;
}

Vec3 Feeder::getTrayPosition() const {
  return dynamics_.bodies[0].position;
}

double Feeder::computeEnergy() const {
  double sum = 0;
  for (const scene::PhysicsBody& solid : dynamics_.bodies)
    if (solid.isDynamic())
      sum += scene::computeKineticEnergy(solid.motion) +
             kGravity * solid.motion.centre.y() / solid.motion.inverseMass;
  return sum;
}

}  // namespace enfilade::testing
