#include "tests/support/parts_feeder.hpp"

#include <gtest/gtest.h>

namespace enfilade::testing {
namespace {

/// Parts that touch nothing, measured between all candidate pairs.
std::size_t countFloating(Feeder& feeder) {
  const scene::PhysicsWorld& dynamics = feeder.getDynamics();
  std::vector<std::uint8_t> touches(dynamics.bodies.size(), 0);
  for (const scene::BodyPair& pair : dynamics.pairs) {
    collision::FeatureCache cache;
    const double apart =
        collision::computeSeparation(placePart(dynamics.bodies[pair.key.a], pair.key.partA),
                                     placePart(dynamics.bodies[pair.key.b], pair.key.partB), cache)
            .distance;
    if (apart > 2 * feeder.getSettings().solver.contactOffset) continue;
    touches[pair.key.a] = touches[pair.key.b] = 1;
  }
  std::size_t floating = 0;
  for (std::size_t i = 0; i < dynamics.bodies.size(); ++i)
    floating += dynamics.bodies[i].isDynamic() && touches[i] == 0 ? 1 : 0;
  return floating;
}

TEST(PartsFeeder, WithTheDriveOffEnergyNeverGrowsAndTheWholeHeapSleepsWithinTenSeconds) {
  const FeederPlan plan = planFeeder(300, 2);
  const FeederCheck check(plan);
  Feeder feeder(plan);
  const double start = feeder.computeEnergy();
  double maxEnergy = start;
  for (int i = 0; i < 600 && (i < 120 || feeder.getReport().awake > 0); ++i) {
    feeder.tick(false);
    maxEnergy = std::max(maxEnergy, feeder.computeEnergy());
    if (i % 20 != 0) continue;
    const FeederFindings findings = check.evaluate(feeder.getParts(), feeder.getTrayPosition());
    ASSERT_EQ(findings.penetrating, 0u) << i;
    ASSERT_EQ(findings.outside, 0u) << i;
  }
  EXPECT_LE(maxEnergy, 1.001 * start);
  EXPECT_LT(feeder.computeEnergy(), 0.5 * start) << "the parts fell";
  EXPECT_EQ(feeder.getReport().awake, 0u);
  EXPECT_EQ(countFloating(feeder), 0u);
}

TEST(PartsFeeder, WithTheDriveOnAllPartsStayInsideWithinEpsilon) {
  const FeederPlan plan = planFeeder(50, 2);
  const FeederCheck check(plan);
  Feeder feeder(plan);
  double low = 1;
  for (int i = 0; i < 150; ++i) {
    feeder.tick(true);
    low = std::min(low, feeder.getTrayPosition().y());
    EXPECT_EQ(feeder.getReport().crushed, 0u) << i;
    const FeederFindings findings = check.evaluate(feeder.getParts(), feeder.getTrayPosition());
    ASSERT_LE(findings.deepest, feeder.getSettings().solver.contactOffset) << i;
    ASSERT_EQ(findings.outside, 0u) << i;
  }
  EXPECT_LT(low, -0.9 * plan.amplitude);
  EXPECT_EQ(feeder.getReport().awake, 50u) << "no part may sleep on a vibrating tray";
}

// The closer two parts are, the less of their motion is proven. Without depenetration more and more
// parts would stop, each held by stopped ones, and the heap would move with the tray as one block.
TEST(PartsFeeder, LeaningPartsStaySeparate) {
  const FeederPlan plan = planFeeder(120, 4);
  Feeder feeder(plan, 2);
  for (int i = 0; i < 500; ++i) feeder.tick(true);
  const scene::PhysicsWorld& dynamics = feeder.getDynamics();
  int leaning = 0, close = 0;
  for (const scene::BodyPair& pair : dynamics.pairs) {
    if (!scene::isTouching(pair, feeder.getSettings().solver.contactOffset)) continue;
    collision::FeatureCache cache;
    const scene::PhysicsBody &a = dynamics.bodies[pair.key.a], &b = dynamics.bodies[pair.key.b];
    const double apart = collision::computeSeparation(placePart(a, pair.key.partA),
                                                      placePart(b, pair.key.partB), cache)
                             .distance;
    ++leaning;
    close += apart < 0.02 * feeder.getSettings().solver.contactOffset;
  }
  EXPECT_GT(leaning, 200);
  EXPECT_LT(close, leaning / 40) << "of " << leaning;
}

TEST(PartsFeeder, EndsAtTheSameBitsWithAnyNumberOfThreadsAndWithoutWideRegisters) {
  const FeederPlan plan = planFeeder(120, 3);
  const auto run = [&](int threads, bool byAvx = true) {
    Feeder feeder(plan, threads);
    feeder.getSettings().solver.useAvx = byAvx;
    for (int i = 0; i < 40; ++i) feeder.tick(true);
    EXPECT_GT(feeder.getReport().constraints, 300u) << "enough to use several threads";
    std::vector<double> numbers;
    for (const PlacedPart& part : feeder.getParts()) {
      for (int k = 0; k < 3; ++k) numbers.push_back(part.position[k]);
      for (int k = 0; k < 4; ++k) numbers.push_back(part.rotation.coeffs()[k]);
    }
    return numbers;
  };
  const std::vector<double> alone = run(1);
  EXPECT_EQ(alone, run(1));
  EXPECT_EQ(alone, run(2));
  EXPECT_EQ(alone, run(8));
  EXPECT_EQ(alone, run(1, false));
}

}  // namespace
}  // namespace enfilade::testing
