#include "tests/support/parts_feeder.hpp"

#include <gtest/gtest.h>

namespace enfilade::testing {
namespace {

TEST(PartsFeeder, WithTheDriveOffNoEnergyIsMadeAndMostFallAsleep) {
  const FeederPlan plan = planFeeder(50, 1);
  const FeederJudge judge(plan);
  Feeder feeder(plan);
  const double start = feeder.energy();
  double most = start;
  // A heap comes to rest when it does: of a dozen seeds half within 300 ticks, the slowest in 840.
  for (int i = 0; i < 1200 && (i < 120 || feeder.report().awake >= 25); ++i) {
    feeder.tick(false);
    most = std::max(most, feeder.energy());
    if (i % 20 != 0) continue;
    const FeederJudgement judgement = judge.judge(feeder.parts(), feeder.tray());
    ASSERT_EQ(judgement.penetrating, 0u) << i;
    ASSERT_EQ(judgement.outside, 0u) << i;
  }
  EXPECT_LE(most, 1.001 * start);
  EXPECT_LT(feeder.energy(), 0.5 * start) << "they fell";
  EXPECT_LT(feeder.report().awake, 25u);
}

TEST(PartsFeeder, WithTheDriveOnAllStayInsideAndNonePenetratesByMoreThanEpsilon) {
  const FeederPlan plan = planFeeder(50, 2);
  const FeederJudge judge(plan);
  Feeder feeder(plan);
  double low = 1;
  for (int i = 0; i < 150; ++i) {
    feeder.tick(true);
    low = std::min(low, feeder.tray().y());
    EXPECT_EQ(feeder.report().squeezed, 0u) << i;
    const FeederJudgement judgement = judge.judge(feeder.parts(), feeder.tray());
    ASSERT_LE(judgement.deepest, feeder.settings().solver.epsilon) << i;
    ASSERT_EQ(judgement.outside, 0u) << i;
  }
  EXPECT_LT(low, -0.9 * plan.amplitude);
  EXPECT_EQ(feeder.report().awake, 50u) << "a vibrating tray lets nobody sleep";
}

// The nearer two parts are, the less of their ways is proved: were they not parted, more and more
// would stand, each held by others that stand, and the heap would go with the tray as one block.
TEST(PartsFeeder, PartsThatLeanOnOneAnotherArePartedAndDoNotGrowTogether) {
  const FeederPlan plan = planFeeder(120, 4);
  Feeder feeder(plan, 2);
  for (int i = 0; i < 500; ++i) feeder.tick(true);
  const scene::Dynamics& dynamics = feeder.dynamics();
  int leaning = 0, close = 0;
  for (const scene::NearPair& pair : dynamics.pairs) {
    if (!scene::leans(pair, feeder.settings().solver.epsilon)) continue;
    collision::FeatureCache cache;
    const scene::Solid &a = dynamics.solids[pair.key.a], &b = dynamics.solids[pair.key.b];
    const double apart =
        collision::decide(partOf(a, pair.key.partA), partOf(b, pair.key.partB), cache).distance;
    ++leaning;
    close += apart < 0.02 * feeder.settings().solver.epsilon;
  }
  EXPECT_GT(leaning, 200);
  EXPECT_LT(close, leaning / 40) << "of " << leaning;
}

TEST(PartsFeeder, EndsAtTheSameBitsWithAnyNumberOfThreadsAndWithoutWideRegisters) {
  const FeederPlan plan = planFeeder(120, 3);
  const auto run = [&](int threads, bool byAvx = true) {
    Feeder feeder(plan, threads);
    feeder.settings().solver.byAvx = byAvx;
    for (int i = 0; i < 40; ++i) feeder.tick(true);
    EXPECT_GT(feeder.report().patches, 300u) << "enough to be shared out";
    std::vector<double> numbers;
    for (const PlacedPart& part : feeder.parts()) {
      for (int k = 0; k < 3; ++k) numbers.push_back(part.position[k]);
      for (int k = 0; k < 4; ++k) numbers.push_back(part.rotation.coeffs()[k]);
    }
    return numbers;
  };
  const std::vector<double> alone = run(1);
  EXPECT_EQ(alone, run(1));
  EXPECT_EQ(alone, run(2));
  EXPECT_EQ(alone, run(3));
  EXPECT_EQ(alone, run(1, false));
}

}  // namespace
}  // namespace enfilade::testing
