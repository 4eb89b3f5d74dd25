// The solver's slow twin: one patch after another, each in doubles of its own, by the steps at the
// head of solver.cpp. What the solver does with four at a time has to come out the same to the last
// bit, whatever the patches are, whoever shares the work and whatever registers there are. Masses,
// what a push does along a direction, colours and free flight are the solver's own: they do not
// depend on how many go together.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "scene/physics/graph_coloring.hpp"
#include "scene/physics/solver.hpp"
#include "scene/physics/solver_rows.hpp"

namespace enfilade::scene {
namespace {

// ---- the twin ----------------------------------------------------------------------------------

/// In the order in which the solver adds.
double product(const Vec3& a, const Vec3& b) {
  return a.x() * b.x() + a.y() * b.y() + a.z() * b.z();
}

struct Way {
  Vec3 velocityA, spinA, velocityB, spinB;
};

struct TwinPoint {
  Direction normal;
  double mass, separation, arrival, impulse, push;
  double parting = 0, sum = 0;
};

struct TwinPatch {
  const ContactPatch* patch;
  std::vector<TwinPoint> points;
  Direction first, second;
  double m11, m12, m22, rub1, rub2, arm, twistMass, twist, mostPush;
  Vec3 turnA, turnB;
};

/// How often what was tried: a test in which nothing slides shows nothing of sliding.
struct Happened {
  int slid = 0, held = 0, pushed = 0, bounced = 0, parted = 0, free = 0;
};

class Twin {
 public:
  Twin(std::span<RigidBody> bodies, std::span<ContactPatch> patches, const SolverStep& step,
       std::span<const std::uint32_t> order)
      : bodies_(bodies), all_(patches), step_(step), seconds_(step.seconds / step.substeps) {
    for (const RigidBody& body : bodies) {
      const bool held = body.inverseMass == 0;
      movers_.push_back({body.velocity, body.spin, Vec3::Zero(), Vec3::Zero(), body.inverseMass,
                         held ? Mat3(Mat3::Zero()) : worldInverseInertia(body)});
    }
    for (const std::uint32_t k : order) add(patches[k]);
  }

  Happened solve(std::span<const DrivenBody> driven) {
    for (std::size_t i = 0; i < static_cast<std::size_t>(step_.substeps); ++i) {
      for (const DrivenBody& body : driven)
        movers_[body.body].velocity = body.gaits[i].velocity,
        movers_[body.body].spin = body.gaits[i].spin;
      substep();
    }
    for (TwinPatch& row : rows_) bounce(row);
    keep();
    return happened_;
  }

 private:
  void add(const ContactPatch& patch) {
    const Mover &a = movers_[patch.a], &b = movers_[patch.b];
    const double masses = a.inverseMass + b.inverseMass, size = static_cast<double>(patch.size);
    TwinPatch row;
    row.patch = &patch;
    Vec3 armA = Vec3::Zero(), armB = Vec3::Zero();
    for (const PatchPoint& point : patch.list()) {
      const Direction normal(patch.normal, point.armA.cross(patch.normal),
                             point.armB.cross(patch.normal), a, b);
      row.points.push_back({normal, inverted(response(normal, normal, masses)), point.separation,
                            normal.speed(a, b), point.impulse, point.push});
      armA += point.armA, armB += point.armB;
    }
    armA /= size, armB /= size;
    int least = 0;
    patch.normal.cwiseAbs().minCoeff(&least);
    const Vec3 first = patch.normal.cross(Vec3::Unit(least)).normalized();
    const Vec3 second = patch.normal.cross(first);
    row.first = Direction(first, armA.cross(first), armB.cross(first), a, b);
    row.second = Direction(second, armA.cross(second), armB.cross(second), a, b);
    const double k11 = response(row.first, row.first, masses);
    const double k12 = response(row.first, row.second, masses);
    const double k22 = response(row.second, row.second, masses);
    const double over = inverted(k11 * k22 - k12 * k12);
    row.m11 = k22 * over, row.m12 = -k12 * over, row.m22 = k11 * over;
    row.rub1 = patch.rub.dot(first), row.rub2 = patch.rub.dot(second), row.twist = patch.twist;
    double arm = 0;
    for (const PatchPoint& point : patch.list()) arm += (point.armB - armB).norm();
    row.arm = arm / size;
    row.turnA = a.inverseInertia * patch.normal, row.turnB = b.inverseInertia * patch.normal;
    row.twistMass = inverted(patch.normal.dot(row.turnA) + patch.normal.dot(row.turnB));
    row.mostPush = patch.mostPush * seconds_ / size;
    rows_.push_back(std::move(row));
  }

  Way going(const TwinPatch& row) const {
    const Mover &a = movers_[row.patch->a], &b = movers_[row.patch->b];
    return {a.velocity, a.spin, b.velocity, b.spin};
  }
  Way parting(const TwinPatch& row) const {
    const Mover &a = movers_[row.patch->a], &b = movers_[row.patch->b];
    return {a.partingVelocity, a.partingSpin, b.partingVelocity, b.partingSpin};
  }
  void goOn(const TwinPatch& row, const Way& way) {
    Mover &a = movers_[row.patch->a], &b = movers_[row.patch->b];
    if (a.yields()) a.velocity = way.velocityA, a.spin = way.spinA;
    if (b.yields()) b.velocity = way.velocityB, b.spin = way.spinB;
  }
  static double speed(const Direction& d, const Way& way) {
    return product(d.along, way.velocityB - way.velocityA) + product(d.angularB, way.spinB) -
           product(d.angularA, way.spinA);
  }
  void push(const TwinPatch& row, const Direction& d, double impulse, Way& way) const {
    way.velocityA -= (impulse * movers_[row.patch->a].inverseMass) * d.along;
    way.spinA -= impulse * d.turnA;
    way.velocityB += (impulse * movers_[row.patch->b].inverseMass) * d.along;
    way.spinB += impulse * d.turnB;
  }
  static void turn(const TwinPatch& row, double moment, Way& way) {
    way.spinA -= moment * row.turnA;
    way.spinB += moment * row.turnB;
  }

  void warmStart(TwinPatch& row) {
    Way way = going(row);
    push(row, row.first, row.rub1, way);
    push(row, row.second, row.rub2, way);
    turn(row, row.twist, way);
    for (const TwinPoint& point : row.points)
      push(row, point.normal, point.impulse + point.push, way);
    goOn(row, way);
  }

  void rub(TwinPatch& row, Way& way) {
    double normalImpulse = 0;
    for (const TwinPoint& point : row.points) normalImpulse += point.impulse + point.push;
    const double most = row.patch->friction * normalImpulse;
    const double speed1 = speed(row.first, way), speed2 = speed(row.second, way);
    double rub1 = row.rub1 - (row.m11 * speed1 + row.m12 * speed2);
    double rub2 = row.rub2 - (row.m12 * speed1 + row.m22 * speed2);
    const double squared = rub1 * rub1 + rub2 * rub2;
    ++(most * most < squared ? happened_.slid : happened_.held);
    if (most * most < squared) {
      const double part = most / std::sqrt(squared);
      rub1 *= part, rub2 *= part;
    }
    push(row, row.first, rub1 - row.rub1, way);
    push(row, row.second, rub2 - row.rub2, way);
    row.rub1 = rub1, row.rub2 = rub2;
    const double turning = product(row.patch->normal, way.spinB - way.spinA);
    const double widest = most * row.arm;
    const double twist = std::clamp(row.twist - row.twistMass * turning, -widest, widest);
    turn(row, twist - row.twist, way);
    row.twist = twist;
  }

  double lacking(const TwinPoint& point, double now) const {
    const double room = point.separation - step_.epsilon;
    const double least = std::min(0.0, -room / seconds_), most = room < step_.epsilon ? 0 : least;
    return now < least ? least - now : std::min(0.0, most - now);
  }

  void iterate(TwinPatch& row) {
    Way way = going(row);
    if (row.patch->friction > 0) rub(row, way);
    for (TwinPoint& point : row.points) {
      const double more = point.mass * lacking(point, speed(point.normal, way));
      const double impulse = std::max(0.0, point.impulse + more);
      push(row, point.normal, impulse - point.impulse, way);
      point.impulse = impulse;
      if (impulse == 0) ++happened_.free;
      if (row.mostPush == 0) continue;
      const double slow = row.patch->pushSpeed - speed(point.normal, way);
      const double given = std::clamp(point.push + point.mass * slow, 0.0, row.mostPush);
      push(row, point.normal, given - point.push, way);
      point.push = given;
      if (given > 0) ++happened_.pushed;
    }
    goOn(row, way);
  }

  double partingSpeed(const TwinPoint& point) const {
    const double room = point.separation - step_.epsilon;
    const double lacks = 0.5 * step_.epsilon - point.separation;
    if (room > 0) return -room / seconds_;
    return lacks > 0 ? std::min(0.25 * lacks / seconds_, 1.0) : 0;
  }

  void part(TwinPatch& row) {
    const Way way = going(row);
    Way apart = parting(row);
    for (TwinPoint& point : row.points) {
      const double also = point.separation > step_.epsilon ? speed(point.normal, way) : 0;
      const double lacks = partingSpeed(point) - (speed(point.normal, apart) + also);
      const double impulse = std::max(0.0, point.parting + point.mass * lacks);
      push(row, point.normal, impulse - point.parting, apart);
      point.parting = impulse;
      if (impulse > 0) ++happened_.parted;
    }
    Mover &a = movers_[row.patch->a], &b = movers_[row.patch->b];
    if (a.yields()) a.partingVelocity = apart.velocityA, a.partingSpin = apart.spinA;
    if (b.yields()) b.partingVelocity = apart.velocityB, b.partingSpin = apart.spinB;
  }

  void substep() {
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      if (!movers_[i].yields()) continue;
      bodies_[i].spin = movers_[i].spin;
      bendSpin(bodies_[i], seconds_);
      movers_[i].spin = bodies_[i].spin;
      movers_[i].velocity += seconds_ * step_.gravity;
    }
    for (TwinPatch& row : rows_) warmStart(row);
    for (int i = 0; i < step_.iterations; ++i)
      for (TwinPatch& row : rows_) iterate(row);
    for (Mover& mover : movers_) mover.partingVelocity = mover.partingSpin = Vec3::Zero();
    for (TwinPatch& row : rows_)
      for (TwinPoint& point : row.points) point.parting = 0;
    for (int i = 0; i < 2; ++i)
      for (TwinPatch& row : rows_) part(row);
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      bodies_[i].velocity = movers_[i].velocity + movers_[i].partingVelocity;
      bodies_[i].spin = movers_[i].spin + movers_[i].partingSpin;
      advance(bodies_[i], seconds_);
    }
    for (TwinPatch& row : rows_) {
      for (TwinPoint& point : row.points) {
        const double both = speed(point.normal, going(row)) + speed(point.normal, parting(row));
        point.separation += seconds_ * both;
        point.sum += point.impulse;
      }
    }
  }

  void bounce(TwinPatch& row) {
    const double e = row.patch->restitution;
    if (e == 0) return;
    const double least = 4 * step_.gravity.norm() * step_.seconds;
    Way way = going(row);
    for (const TwinPoint& point : row.points) {
      if (point.sum <= 0 || point.arrival > -least) continue;
      const double lacks = -e * point.arrival - speed(point.normal, way);
      const double back = std::clamp(point.mass * lacks, 0.0, e * point.sum);
      push(row, point.normal, back, way);
      if (back > 0) ++happened_.bounced;
    }
    goOn(row, way);
  }

  void keep() {
    for (std::size_t i = 0; i < bodies_.size(); ++i)
      bodies_[i].velocity = movers_[i].velocity, bodies_[i].spin = movers_[i].spin;
    for (const TwinPatch& row : rows_) {
      ContactPatch& patch = all_[static_cast<std::size_t>(row.patch - all_.data())];
      for (std::size_t i = 0; i < patch.size; ++i) {
        patch.points[i].separation = row.points[i].separation;
        patch.points[i].impulse = row.points[i].impulse;
        patch.points[i].push = row.points[i].push;
      }
      patch.rub = row.rub1 * row.first.along + row.rub2 * row.second.along;
      patch.twist = row.twist;
    }
  }

  std::span<RigidBody> bodies_;
  std::span<ContactPatch> all_;
  const SolverStep& step_;
  double seconds_;
  std::vector<Mover> movers_;
  std::vector<TwinPatch> rows_;
  Happened happened_;
};

// ---- heaps -------------------------------------------------------------------------------------

struct Heap {
  std::vector<RigidBody> bodies;
  std::vector<ContactPatch> patches;
  std::vector<Gait> gaits;
  std::uint32_t drivenBody = 0;

  std::vector<DrivenBody> driven() const { return {{drivenBody, gaits}}; }
};

class HeapMaker {
 public:
  explicit HeapMaker(unsigned seed) : random_(seed) {}

  /// Body 0 stands, body 1 is driven. `hub`: of the patches, how many lean on body 2.
  Heap make(std::size_t bodies, std::size_t patches, std::size_t hub, const SolverStep& step) {
    Heap heap;
    for (std::size_t i = 0; i < bodies; ++i) heap.bodies.push_back(body(i > 1));
    heap.drivenBody = 1;
    for (int i = 0; i < step.substeps; ++i) heap.gaits.push_back({vector(0.5), vector(1)});
    for (std::size_t i = 0; i < patches; ++i) heap.patches.push_back(patch(bodies, i < hub));
    return heap;
  }

 private:
  double number(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  bool oneOf(int many) { return number(0, many) < 1; }
  Vec3 vector(double size) {
    const double x = number(-size, size), y = number(-size, size);
    return {x, y, number(-size, size)};
  }
  std::uint32_t index(std::size_t from, std::size_t to) {
    return static_cast<std::uint32_t>(
        std::uniform_int_distribution<std::size_t>(from, to)(random_));
  }

  RigidBody body(bool free) {
    RigidBody body;
    body.centre = vector(1);
    body.velocity = free ? vector(3) : Vec3(Vec3::Zero());
    if (!free) return body;
    body.spin = vector(3);
    body.rotation = Quat(1, number(-1, 1), number(-1, 1), number(-1, 1)).normalized();
    body.inverseMass = 1 / number(0.5, 8);
    body.inertia = Vec3(number(0.1, 0.3), number(0.1, 0.3), number(0.1, 0.3)).asDiagonal();
    body.inverseInertia = body.inertia.inverse();
    return body;
  }

  ContactPatch patch(std::size_t bodies, bool atHub) {
    ContactPatch patch;
    patch.a = atHub ? 2 : index(0, bodies - 1);
    do patch.b = index(2, bodies - 1);
    while (patch.b == patch.a);
    if (oneOf(3)) std::swap(patch.a, patch.b);
    patch.normal = (vector(1) + Vec3(0, 1e-3, 0)).normalized();
    patch.friction = oneOf(3) ? 0 : number(0.05, 1.2);
    patch.restitution = oneOf(2) ? 0 : number(0.1, 0.9);
    patch.size = index(1, ContactPatch::kMostPoints);
    const bool warm = oneOf(2);
    if (oneOf(4)) patch.mostPush = number(1, 200), patch.pushSpeed = number(0.1, 2);
    for (std::size_t i = 0; i < patch.size; ++i) {
      PatchPoint& point = patch.points[i];
      point.armA = vector(0.3), point.armB = vector(0.3);
      point.separation = 0.5e-3 * number(-2, 4);
      if (warm) point.impulse = number(0, 0.05);
    }
    if (!warm || patch.friction == 0) return patch;
    const Vec3 any = vector(0.02);
    patch.rub = any - patch.normal.dot(any) * patch.normal;
    patch.twist = number(-0.01, 0.01);
    return patch;
  }

  std::mt19937 random_;
};

std::vector<std::uint32_t> orderOf(const Heap& heap) {
  std::vector<std::uint8_t> moves;
  for (const RigidBody& body : heap.bodies) moves.push_back(body.inverseMass > 0);
  return colourPatches(heap.patches, moves).order;
}

std::vector<std::uint32_t> asTheyCome(const Heap& heap) {
  std::vector<std::uint32_t> order;
  for (std::uint32_t i = 0; i < heap.patches.size(); ++i) order.push_back(i);
  return order;
}

/// "" or the first number that differs; the sign of a zero is none.
std::string difference(const Heap& a, const Heap& b) {
  for (std::size_t i = 0; i < a.bodies.size(); ++i) {
    const RigidBody &x = a.bodies[i], &y = b.bodies[i];
    if (x.velocity != y.velocity || x.spin != y.spin) return "motion of body " + std::to_string(i);
    if (x.centre != y.centre || x.rotation.coeffs() != y.rotation.coeffs())
      return "place of body " + std::to_string(i);
  }
  for (std::size_t i = 0; i < a.patches.size(); ++i) {
    const ContactPatch &x = a.patches[i], &y = b.patches[i];
    if (x.rub != y.rub || x.twist != y.twist) return "friction of patch " + std::to_string(i);
    for (std::size_t k = 0; k < x.size; ++k)
      if (x.points[k].impulse != y.points[k].impulse || x.points[k].push != y.points[k].push ||
          x.points[k].separation != y.points[k].separation)
        return "point " + std::to_string(k) + " of patch " + std::to_string(i);
  }
  return "";
}

struct Size {
  std::size_t bodies, patches, hub;
};

/// Some few, which keep their order; many, by colours; and many that lean on one, more than there
/// are colours.
constexpr Size kSizes[] = {{4, 2, 0}, {12, 9, 0}, {40, 150, 6}, {150, 400, 0}, {90, 500, 60}};

void compareWithTwin(bool byAvx) {
  Happened all;
  for (const Size& size : kSizes) {
    for (unsigned seed = 1; seed <= 12; ++seed) {
      SCOPED_TRACE(std::to_string(size.patches) + " patches, seed " + std::to_string(seed));
      SolverStep step;
      step.byAvx = byAvx;
      step.substeps = 1 + static_cast<int>(seed % 4);
      step.iterations = 1 + static_cast<int>(seed % 3);
      const Heap start = HeapMaker(seed).make(size.bodies, size.patches, size.hub, step);
      Heap slow = start;
      const bool few = size.patches < kFewPatches;
      const Happened one =
          Twin(slow.bodies, slow.patches, step, few ? asTheyCome(slow) : orderOf(slow))
              .solve(slow.driven());
      all.slid += one.slid, all.held += one.held, all.pushed += one.pushed;
      all.bounced += one.bounced, all.parted += one.parted, all.free += one.free;
      for (const int threads : {1, 2}) {
        Heap fast = start;
        Workers workers(threads);
        solve(fast.bodies, fast.patches, {}, fast.driven(), step, workers);
        EXPECT_EQ(difference(slow, fast), "") << threads << " threads";
        EXPECT_NE(difference(start, fast), "");
      }
    }
  }
  for (const int count : {all.slid, all.held, all.pushed, all.bounced, all.parted, all.free})
    EXPECT_GT(count, 1000);
}

TEST(SolverTwin, FourPatchesSideBySideEndAsOneAfterAnother) {
  compareWithTwin(false);
}

TEST(SolverTwin, FourPatchesInWideRegistersEndAsOneAfterAnother) {
  if (!hasAvx()) GTEST_SKIP() << "this processor has no AVX: only the other half was compared";
  compareWithTwin(true);
}

TEST(SolverTwin, APatchWithoutPointsDoesNothing) {
  SolverStep step;
  Heap heap = HeapMaker(1).make(40, 150, 6, step), more = heap;
  for (std::uint32_t i = 2; i < 30; ++i) {
    ContactPatch none;
    none.a = i, none.b = i + 1, none.friction = 0.5;
    more.patches.push_back(none);
  }
  for (Heap* each : {&heap, &more}) {
    Workers workers(2);
    solve(each->bodies, each->patches, {}, each->driven(), step, workers);
  }
  EXPECT_EQ(difference(heap, more), "");
}

}  // namespace
}  // namespace enfilade::scene
