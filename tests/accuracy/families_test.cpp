// Compares pairs of the families with the exact reference at both levels, and tests invariances.
// `accuracy_tests --count N` makes N cases per family; the default is 12.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <iostream>

#include "collision/shapes/hull.hpp"
#include "tests/accuracy/case_score.hpp"
#include "tests/accuracy/families.hpp"

namespace enfilade::accuracy {
namespace {

int casesPerFamily = 12;

constexpr std::uint64_t kSeed = 20261;

std::string listFaults(const Score& score) {
  std::string text;
  for (const std::string& fault : score.faults) text += fault + '\n';
  return text;
}

Answer answerCold(const Case& testCase, Level level) {
  WarmStart cold;
  return answerCase(testCase, {}, level, cold);
}

/// Calls `check(case)` for the cases of a family, from a fixed seed.
template <typename Check>
void forEachCase(const Family& family, const Check& check) {
  Random random(kSeed);
  for (int i = 0; i < casesPerFamily; ++i) check(makeCase(family, random, i));
}

class Families : public ::testing::TestWithParam<Family> {};

TEST_P(Families, EqualTheExactReferenceAtBothLevels) {
  Score decided, refined;
  forEachCase(GetParam(), [&](const Case& testCase) {
    addToScore(testCase, answerCold(testCase, Level::decide), Level::decide, {}, decided);
    addToScore(testCase, answerCold(testCase, Level::refine), Level::refine, {}, refined);
  });
  EXPECT_EQ(decided.count, casesPerFamily);
  EXPECT_TRUE(holds(decided)) << "at decide:\n" << listFaults(decided);
  EXPECT_TRUE(holds(refined)) << "at refine:\n" << listFaults(refined);
  EXPECT_EQ(refined.noDepth, 0);
}

Case scaleCase(Case testCase, double factor) {
  for (Placed* body : {&testCase.a, &testCase.b}) {
    for (Vec3& p : body->points) p *= factor;
    body->translation *= factor;
  }
  if (testCase.clearance) *testCase.clearance *= factor;
  return testCase;
}

TEST_P(Families, ScalingByPowersOfTwoScalesTheAnswer) {
  forEachCase(GetParam(), [&](const Case& testCase) {
    const Answer here = answerCold(testCase, Level::refine);
    for (const double factor : {0x1p40, 0x1p-40}) {
      const Answer there = answerCold(scaleCase(testCase, factor), Level::refine);
      EXPECT_EQ(here.verdict, there.verdict) << testCase.id;
      EXPECT_EQ(here.near, there.near) << testCase.id;
      EXPECT_EQ(here.distance * factor, there.distance) << testCase.id;
      EXPECT_EQ(here.penetration.value_or(0) * factor, there.penetration.value_or(0))
          << testCase.id;
      EXPECT_EQ(answerCold(scaleCase(testCase, factor), Level::decide).verdict, here.verdict)
          << testCase.id;
    }
  });
}

/// Moves both bodies; false if that rounds.
bool move(Case& testCase, const Vec3& by) {
  for (Placed* body : {&testCase.a, &testCase.b}) {
    const Vec3 before = body->translation;
    body->translation += by;
    for (int k = 0; k < 3; ++k)
      if (toPreciseNumber(body->translation[k]) != toPreciseNumber(before[k]) + by[k]) return false;
  }
  return true;
}

TEST_P(Families, AnExactMoveOfBothChangesNoNumber) {
  forEachCase(GetParam(), [&](const Case& testCase) {
    Case moved = testCase;
    for (Placed* body : {&moved.a, &moved.b}) {
      if (body->translation.cwiseAbs().maxCoeff() > 0x1p20) return;
      for (double& t : body->translation) t = std::round(t * 0x1p30) * 0x1p-30;
    }
    moved.truth = computeTruth(moved);
    const Answer here = answerCold(moved, Level::refine);
    EXPECT_EQ(here.near, moved.truth.near) << testCase.id;
    if (!move(moved, {1024, -512, 256})) return;
    const Answer there = answerCold(moved, Level::refine);
    EXPECT_EQ(here.verdict, there.verdict) << testCase.id;
    EXPECT_EQ(here.distance, there.distance) << testCase.id;
    EXPECT_EQ(here.penetration, there.penetration) << testCase.id;
    EXPECT_EQ(answerCold(moved, Level::decide).verdict, here.verdict) << testCase.id;
  });
}

TEST_P(Families, SwappingTheBodiesSwapsTheAnswer) {
  forEachCase(GetParam(), [&](const Case& testCase) {
    Case swapped = testCase;
    std::swap(swapped.a, swapped.b);
    const Answer here = answerCold(testCase, Level::refine);
    const Answer there = answerCold(swapped, Level::refine);
    EXPECT_EQ(here.verdict, there.verdict) << testCase.id;
    EXPECT_EQ(here.near, there.near) << testCase.id;
    EXPECT_EQ(here.distance, there.distance) << testCase.id;
    EXPECT_EQ(here.penetration, there.penetration) << testCase.id;
    EXPECT_EQ(answerCold(swapped, Level::decide).verdict, here.verdict) << testCase.id;
  });
}

INSTANTIATE_TEST_SUITE_P(All, Families, ::testing::ValuesIn(getFamilies()),
                         [](const auto& family) { return std::string(family.param.name); });

TEST(FamiliesTogether, MeetEveryVerdictOften) {
  std::map<std::string, int> verdicts;
  for (const Family& family : getFamilies())
    forEachCase(family, [&](const Case& testCase) { ++verdicts[testCase.truth.verdict]; });
  const int all = casesPerFamily * static_cast<int>(getFamilies().size());
  for (const char* verdict : {"separated", "touching", "penetrating"})
    EXPECT_GT(verdicts[verdict], all / 10) << verdict;
}

}  // namespace
}  // namespace enfilade::accuracy

int main(int count, char** arguments) {
  ::testing::InitGoogleTest(&count, arguments);
  for (int i = 1; i + 1 < count; ++i)
    if (std::strcmp(arguments[i], "--count") == 0)
      enfilade::accuracy::casesPerFamily = std::atoi(arguments[i + 1]);
  return RUN_ALL_TESTS();
}
