// Benchmark of lower bounds on the time to contact of two bodies: ours and that of Lin (1993),
// compared with the true time of impact.
//
//   collision_time_to_contact [--quick] [--out FILE]
//
// Also times of impact of thin bodies that pass through each other at a time that is no double,
// compared with the exact time.
//
// Lin (1993, section 5.1) uses the closing speed of the closest points and the maximum acceleration
// of any vertex. A bound is broken if the bodies provably meet before it. `rod` is a
// counter-example to it: a rod along a wall rotates about its middle, which is closest and at rest.

#include <array>
#include <cstdio>
#include <functional>
#include <vector>

#include "collision/motion/time_of_impact.hpp"
#include "collision/motion/time_to_contact.hpp"
#include "collision/shapes/hull.hpp"
#include "tests/benchmarks/building_workload.hpp"
#include "tests/benchmarks/measurement.hpp"
#include "tests/support/exact_crossing.hpp"

namespace {

using namespace enfilade::benchmarks;
using namespace enfilade::collision;

constexpr double kHorizon = 10;  // seconds

struct MovingPair {
  Hull hullA, hullB;
  Motion motionA, motionB;
  Vec3 between;  ///< from A's reference point to B's

  MovingBody getBodyA() const { return {{hullA.vertices, Vec3::Zero(), nullptr, &hullA}, motionA}; }
  MovingBody getBodyB() const { return {{hullB.vertices, between, nullptr, &hullB}, motionB}; }
};

Vec3 drawVector(Random& random, double size) {
  const double x = drawUniform(random, -size, size), y = drawUniform(random, -size, size);
  const double z = drawUniform(random, -size, size);
  return {x, y, z};
}

Hull makeBoxHull(const Vec3& half) {
  std::vector<Vec3> corners;
  for (int k = 0; k < 8; ++k)
    corners.emplace_back(k & 1 ? half.x() : -half.x(), k & 2 ? half.y() : -half.y(),
                         k & 4 ? half.z() : -half.z());
  return buildHull(corners);
}

Hull makeStone(Random& random) {
  std::vector<Vec3> points;
  for (int k = 0; k < 20; ++k) points.push_back(drawVector(random, 0.5));
  return buildHull(points);
}

MovingPair makeRod(Random& random) {
  const double halfLength = drawUniform(random, 0.5, 2);
  const double gap = std::pow(10.0, drawUniform(random, -5, -2));
  MovingPair e{makeBoxHull({halfLength, 0.02, 0.02}), makeBoxHull({5, 0.1, 5}), {}, {}, {0, 0, 0}};
  e.between.y() = -(0.02 + gap + 0.1);
  e.motionA.angularVelocity = Vec3(0, 0, drawUniform(random, 0.5, 3));
  return e;
}

MovingPair makeFlight(Random& random, bool turning) {
  MovingPair e{makeStone(random), makeStone(random), {}, {}, {drawUniform(random, 2, 4), 0, 0}};
  e.motionA.velocity = Vec3(drawUniform(random, 0.5, 3), 0, 0) + drawVector(random, 0.2);
  e.motionB.acceleration = drawVector(random, 0.5);
  if (!turning) return e;
  e.motionA.angularVelocity = drawVector(random, 3);
  e.motionB.angularVelocity = drawVector(random, 3);
  return e;
}

MotionBounds computeMotionBounds(const MovingBody& moving) {
  const Motion& m = moving.motion;
  return {m.velocity, m.acceleration.norm(), m.angularVelocity, 0,
          computeRadius(moving.body, false)};
}

/// Gap, normal and closest points are the input of both bounds.
double computeOurTime(const MovingPair& e, const SeparationResult& gap) {
  const ClosingBounds closing = computeClosingBounds(
      computeMotionBounds(e.getBodyA()), computeMotionBounds(e.getBodyB()), gap.normal, kHorizon);
  return computeTimeToContact(gap.distance - gap.errorBound, closing);
}

double computeSeedTime(const MovingPair& e, const SeparationResult& gap) {
  const auto velocityAt = [](const MovingBody& moving, const Vec3& point) {
    return Vec3(moving.motion.velocity +
                moving.motion.angularVelocity.cross(point - moving.body.translation));
  };
  const auto computeAcceleration = [](const MovingBody& moving) {
    const Motion& m = moving.motion;
    return m.acceleration.norm() +
           m.angularVelocity.squaredNorm() * computeRadius(moving.body, false);
  };
  const double v =
      (velocityAt(e.getBodyA(), gap.pointA) - velocityAt(e.getBodyB(), gap.pointB)).dot(gap.normal);
  const double a = computeAcceleration(e.getBodyA()) + computeAcceleration(e.getBodyB());
  if (a == 0) return v > 0 ? gap.distance / v : kHorizon;
  return (std::sqrt(v * v + 2 * a * gap.distance) - v) / a;
}

struct Tally {
  std::size_t broken = 0;
  std::vector<double> share;  ///< fractions of the true time
  double seconds = 0;
};

void measure(const char* motion, const std::vector<MovingPair>& pairs, Results& results) {
  Tally ours, seeds, impacts;
  std::size_t met = 0, unproved = 0;
  for (const MovingPair& e : pairs) {
    FeatureCache cache;
    const SeparationResult gap = computeSeparation(e.getBodyA().body, e.getBodyB().body, cache);
    auto start = Clock::now();
    const MotionResult impact = computeTimeOfImpact(e.getBodyA(), e.getBodyB(), kHorizon, cache);
    impacts.seconds += measureSecondsSince(start);
    unproved += impact.outcome == MotionOutcome::unproved;
    if (impact.outcome != MotionOutcome::contact) continue;
    ++met;
    const auto compare = [&](Tally& tally, auto&& bound) {
      start = Clock::now();
      const double time = bound(e, gap);
      tally.seconds += measureSecondsSince(start);
      tally.broken += time > impact.hi;
      tally.share.push_back(time / impact.hi);
    };
    compare(ours, computeOurTime);
    compare(seeds, computeSeedTime);
  }
  const auto printRow = [&](const char* name, const Tally& tally, std::size_t asked) {
    const double ns = 1e9 * tally.seconds / static_cast<double>(asked);
    const double median = computeQuantile(tally.share, 0.5);
    std::printf("%-12s %-22s | %5zu of %5zu broken | %8.3g of the true time | %9.0f ns\n", motion,
                name, tally.broken, met, median, ns);
    results.add({{"bench", "time"},
                 {"motion", motion},
                 {"method", name},
                 {"met", met},
                 {"unproved", unproved},
                 {"broken", tally.broken},
                 {"share", toJsonNumber(median)},
                 {"ns", ns}});
  };
  printRow("ours: bound", ours, met);
  printRow("bound of Lin (1993)", seeds, met);
  printRow("ours: time of impact", impacts, pairs.size());
}

struct ThinKind {
  const char* name;
  int verticesA, verticesB;
};

/// Random thin bodies that translate past or through each other within 3 seconds.
void measureCrossings(const ThinKind& kind, std::size_t count, Results& results) {
  testing::Random random(6);
  std::array<std::vector<Vec3>, 2> points;
  std::vector<double> hits, misses;  ///< nanoseconds
  std::size_t proved = 0, late = 0, falseHits = 0;
  for (std::size_t k = 0; k < count; ++k) {
    MovingBody a, b;
    testing::makeThinPair(random, kind.verticesA, kind.verticesB, points, a, b);
    const auto exact = testing::findFirstTime(a, b);
    FeatureCache cache;
    const auto start = Clock::now();
    const MotionResult impact = computeTimeOfImpact(a, b, 3, cache);
    const double ns = 1e9 * measureSecondsSince(start);
    const bool isContact = impact.outcome == MotionOutcome::contact;
    if (!exact || *exact > 3) {
      misses.push_back(ns);
      falseHits += isContact;
      continue;
    }
    hits.push_back(ns);
    proved += isContact && mpq_class(impact.hi) >= *exact;
    late += mpq_class(impact.lo) > *exact;
  }
  std::printf(
      "crossing     %-22s | %5zu of %5zu hits proved, %zu late | %zu of %zu false | %9.0f ns\n",
      kind.name, proved, hits.size(), late, falseHits, misses.size(), computeQuantile(hits, 0.5));
  results.add({{"bench", "crossing"},
               {"kind", kind.name},
               {"hits", hits.size()},
               {"proved", proved},
               {"late", late},
               {"misses", misses.size()},
               {"false", falseHits},
               {"hit_ns", toJsonNumber(computeQuantile(hits, 0.5))},
               {"hit_p99_ns", toJsonNumber(computeQuantile(hits, 0.99))},
               {"miss_ns", toJsonNumber(computeQuantile(misses, 0.5))}});
}

}  // namespace

int main(int argc, char** argv) {
  const Arguments arguments(argc, argv);
  Results results(arguments);
  const std::size_t count = arguments.quick ? 100 : 1000;
  Random random(5);
  const auto some = [&](const std::function<MovingPair()>& one) {
    std::vector<MovingPair> pairs;
    for (std::size_t k = 0; k < count; ++k) pairs.push_back(one());
    return pairs;
  };
  measure("translation", some([&] { return makeFlight(random, false); }), results);
  measure("turning", some([&] { return makeFlight(random, true); }), results);
  measure("rod", some([&] { return makeRod(random); }), results);
  for (const ThinKind& kind :
       {ThinKind{"point, triangle", 1, 3}, ThinKind{"edge, edge", 2, 2},
        ThinKind{"edge, triangle", 2, 3}, ThinKind{"triangle, triangle", 3, 3}})
    measureCrossings(kind, 10 * count, results);
}
