// Pairs of the families against the judge, at both levels, and what must not change an answer.
// `accuracy_tests --count N` makes N of each family instead of a few.
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

int casesOfEachFamily = 12;

constexpr std::uint64_t kSeed = 20261;

std::string listed(const Score& score) {
  std::string text;
  for (const std::string& fault : score.faults) text += fault + '\n';
  return text;
}

Answer answerCold(const Case& asked, Level level) {
  Warmth cold;
  return answerCase(asked, {}, level, cold);
}

/// Calls `check(case)` for the cases of a family; the seed is the family's own.
template <typename Check>
void forEachCase(const Family& family, const Check& check) {
  Random random(kSeed);
  for (int i = 0; i < casesOfEachFamily; ++i) check(madeCase(family, random, i));
}

class Families : public ::testing::TestWithParam<Family> {};

TEST_P(Families, AreAnsweredAsTheJudgeDoesAtBothLevels) {
  Score decided, refined;
  forEachCase(GetParam(), [&](const Case& asked) {
    addToScore(asked, answerCold(asked, Level::decide), Level::decide, {}, decided);
    addToScore(asked, answerCold(asked, Level::refine), Level::refine, {}, refined);
  });
  EXPECT_EQ(decided.count, casesOfEachFamily);
  EXPECT_TRUE(holds(decided)) << "at decide:\n" << listed(decided);
  EXPECT_TRUE(holds(refined)) << "at refine:\n" << listed(refined);
  EXPECT_EQ(refined.noDepth, 0);
}

Case scaled(Case asked, double factor) {
  for (Placed* body : {&asked.a, &asked.b}) {
    for (Vec3& p : body->points) p *= factor;
    body->translation *= factor;
  }
  if (asked.clearance) *asked.clearance *= factor;
  return asked;
}

TEST_P(Families, ScalingByPowersOfTwoScalesTheAnswer) {
  forEachCase(GetParam(), [&](const Case& asked) {
    const Answer here = answerCold(asked, Level::refine);
    for (const double factor : {0x1p40, 0x1p-40}) {
      const Answer there = answerCold(scaled(asked, factor), Level::refine);
      EXPECT_EQ(here.verdict, there.verdict) << asked.id;
      EXPECT_EQ(here.near, there.near) << asked.id;
      EXPECT_EQ(here.distance * factor, there.distance) << asked.id;
      EXPECT_EQ(here.penetration.value_or(0) * factor, there.penetration.value_or(0)) << asked.id;
      EXPECT_EQ(answerCold(scaled(asked, factor), Level::decide).verdict, here.verdict) << asked.id;
    }
  });
}

/// Moves both bodies; false where that rounds.
bool move(Case& asked, const Vec3& by) {
  for (Placed* body : {&asked.a, &asked.b}) {
    const Vec3 before = body->translation;
    body->translation += by;
    for (int k = 0; k < 3; ++k)
      if (preciseNumber(body->translation[k]) != preciseNumber(before[k]) + by[k]) return false;
  }
  return true;
}

TEST_P(Families, AnExactMoveOfBothChangesNoNumber) {
  forEachCase(GetParam(), [&](const Case& asked) {
    Case moved = asked;
    for (Placed* body : {&moved.a, &moved.b}) {
      if (body->translation.cwiseAbs().maxCoeff() > 0x1p20) return;
      for (double& t : body->translation) t = std::round(t * 0x1p30) * 0x1p-30;
    }
    moved.truth = judged(moved);
    const Answer here = answerCold(moved, Level::refine);
    EXPECT_EQ(here.near, moved.truth.near) << asked.id;
    if (!move(moved, {1024, -512, 256})) return;
    const Answer there = answerCold(moved, Level::refine);
    EXPECT_EQ(here.verdict, there.verdict) << asked.id;
    EXPECT_EQ(here.distance, there.distance) << asked.id;
    EXPECT_EQ(here.penetration, there.penetration) << asked.id;
    EXPECT_EQ(answerCold(moved, Level::decide).verdict, here.verdict) << asked.id;
  });
}

TEST_P(Families, SwappingTheBodiesSwapsTheAnswer) {
  forEachCase(GetParam(), [&](const Case& asked) {
    Case swapped = asked;
    std::swap(swapped.a, swapped.b);
    const Answer here = answerCold(asked, Level::refine);
    const Answer there = answerCold(swapped, Level::refine);
    EXPECT_EQ(here.verdict, there.verdict) << asked.id;
    EXPECT_EQ(here.near, there.near) << asked.id;
    EXPECT_EQ(here.distance, there.distance) << asked.id;
    EXPECT_EQ(here.penetration, there.penetration) << asked.id;
    EXPECT_EQ(answerCold(swapped, Level::decide).verdict, here.verdict) << asked.id;
  });
}

INSTANTIATE_TEST_SUITE_P(All, Families, ::testing::ValuesIn(families()),
                         [](const auto& family) { return std::string(family.param.name); });

TEST(FamiliesTogether, MeetEveryVerdictOften) {
  std::map<std::string, int> verdicts;
  for (const Family& family : families())
    forEachCase(family, [&](const Case& asked) { ++verdicts[asked.truth.verdict]; });
  const int all = casesOfEachFamily * static_cast<int>(families().size());
  for (const char* verdict : {"separated", "touching", "penetrating"})
    EXPECT_GT(verdicts[verdict], all / 10) << verdict;
}

}  // namespace
}  // namespace enfilade::accuracy

int main(int count, char** arguments) {
  ::testing::InitGoogleTest(&count, arguments);
  for (int i = 1; i + 1 < count; ++i)
    if (std::strcmp(arguments[i], "--count") == 0)
      enfilade::accuracy::casesOfEachFamily = std::atoi(arguments[i + 1]);
  return RUN_ALL_TESTS();
}
