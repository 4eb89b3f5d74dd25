// The score must detect faults: each test corrupts one number of a correct answer.
#include "tests/accuracy/case_score.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <functional>

#include "tests/support/temporary_folder.hpp"

namespace enfilade::accuracy {
namespace {

using collision::Verdict;

const std::vector<Vec3> kCube{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0},
                              {0, 0, 1}, {1, 0, 1}, {0, 1, 1}, {1, 1, 1}};

Case makeSeparatedCase() {
  Case testCase;
  testCase.id = "apart", testCase.family = "test";
  testCase.a.points = testCase.b.points = kCube;
  testCase.b.translation = {3, 0, 0};
  testCase.clearance = 1.5;
  testCase.truth.verdict = "separated", testCase.truth.distance = "2", testCase.truth.near = true;
  return testCase;
}

Case makePenetratingCase() {
  Case testCase = makeSeparatedCase();
  testCase.b.translation = {0.75, 0.125, 0};
  testCase.truth.verdict = "penetrating", testCase.truth.distance = "0",
  testCase.truth.penetration = "0.25";
  return testCase;
}

Answer computeAnswer(const Case& testCase, Level level) {
  WarmStart cold;
  return answerCase(testCase, {}, level, cold);
}

bool passes(const Case& testCase, const Answer& answer, Level level) {
  Score score;
  addToScore(testCase, answer, level, {}, score);
  return holds(score);
}

TEST(Score, RightAnswersPass) {
  for (const Level level : {Level::decide, Level::refine}) {
    EXPECT_TRUE(passes(makeSeparatedCase(), computeAnswer(makeSeparatedCase(), level), level));
    EXPECT_TRUE(passes(makePenetratingCase(), computeAnswer(makePenetratingCase(), level), level));
  }
}

TEST(Score, EveryCorruptedAnswerFails) {
  using Spoil = std::function<void(Answer&)>;
  const std::vector<std::pair<const char*, Spoil>> spoils{
      {"verdict", [](Answer& a) { a.verdict = Verdict::touching; }},
      {"near", [](Answer& a) { a.near = false; }},
      {"no near", [](Answer& a) { a.near.reset(); }},
      {"distance", [](Answer& a) { a.distance *= 1 + 0x1p-48; }},
      {"not a number", [](Answer& a) { a.distance = std::numeric_limits<double>::quiet_NaN(); }},
      {"point of A", [](Answer& a) { a.pointA.y() -= 0x1p-40; }},
      {"point of B", [](Answer& a) { a.pointB.x() += 0x1p-40; }},
      {"inside A",
       [](Answer& a) {
         a.pointA = {0.9, 0.5, 0.5};
       }},
      {"thrown", [](Answer& a) { a.error = "thrown"; }}};
  for (const auto& [name, spoil] : spoils) {
    Answer answer = computeAnswer(makeSeparatedCase(), Level::refine);
    spoil(answer);
    EXPECT_FALSE(passes(makeSeparatedCase(), answer, Level::refine)) << name;
  }
}

TEST(Score, ACorruptedDepthFails) {
  Answer refined = computeAnswer(makePenetratingCase(), Level::refine);
  *refined.penetration *= 1 + 1e-11;
  EXPECT_FALSE(passes(makePenetratingCase(), refined, Level::refine));
  Answer decided = computeAnswer(makePenetratingCase(), Level::decide);
  decided.depthIsGlobal = true;
  *decided.penetration += 1.01 * decided.errorBound + 0x1p-50;
  EXPECT_FALSE(passes(makePenetratingCase(), decided, Level::decide));
}

TEST(Score, ABoundThatIsTooWideOrTooNarrowFails) {
  Answer answer = computeAnswer(makeSeparatedCase(), Level::decide);
  answer.errorBound = 17 * 0x1p-53 * 4;
  EXPECT_FALSE(passes(makeSeparatedCase(), answer, Level::decide));
  answer.errorBound = 0;
  answer.distance = 2 + 0x1p-51;
  EXPECT_FALSE(passes(makeSeparatedCase(), answer, Level::decide));
}

TEST(Score, ATimeOfImpactMustHoldTheTruthAndBeNarrow) {
  Case testCase = makeSeparatedCase();
  testCase.course = Course{{1, 0, 0}, Vec3::Zero()};
  testCase.truth.tc = "2";
  testCase.truth.toi = {2 - 0x1p-52, 2};
  const Answer right = computeAnswer(testCase, Level::refine);
  EXPECT_TRUE(passes(testCase, right, Level::refine));
  for (const std::array<double, 2> wrong :
       {std::array{1.9, 2.1}, {2 + 1e-13, 2 + 2e-13}, {2 - 2e-13, 2 - 1e-13}}) {
    Answer answer = right;
    answer.toi = wrong;
    EXPECT_FALSE(passes(testCase, answer, Level::refine));
  }
  for (const double tc : {0.0, 1.9, 2 + 0x1p-51}) {
    Answer answer = right;
    answer.tc = tc;
    EXPECT_FALSE(passes(testCase, answer, Level::refine)) << tc;
  }
  Answer missed = right;
  missed.toi.reset();
  EXPECT_FALSE(passes(testCase, missed, Level::refine));
}

TEST(CaseFile, ALineIsReadAndAnsweredInTheRequestedFormat) {
  const auto file = tests::makeOwnFile("one_case.jsonl");
  std::ofstream(file) << R"({"id":"x-1","family":"f","a":[[0,0,0],[1,0,0]],"b":[[0,0,2]],)"
                      << R"("pose_a":[1,0,0,0,0,1,0,0,0,0,1,0],"pose_b":[1,0,0,0,0,1,0,0,0,0,1,0],)"
                      << R"("verdict":"separated","distance":"2","penetration":null,"seq":4})"
                      << "\n\n";
  const std::vector<Case> cases = readCases(file);
  ASSERT_EQ(cases.size(), 1u);
  EXPECT_EQ(cases[0].sequence, 4);
  Answer answer = computeAnswer(cases[0], Level::refine);
  EXPECT_TRUE(passes(cases[0], answer, Level::refine));
  answer.nanoseconds = 5;
  EXPECT_EQ(formatJsonLine(cases[0], answer),
            R"({"id":"x-1","verdict":"separated","distance":2,"penetration":null,"depth_is":null,)"
            R"("near":null,"point_a":[0,0,0],"point_b":[0,0,2],"error_bound":)" +
                formatJsonLine(cases[0], answer)
                    .substr(formatJsonLine(cases[0], answer).find("error_bound") + 13));
}

TEST(CaseFile, ABrokenLineIsNamed) {
  const auto file = tests::makeOwnFile("broken_case.jsonl");
  std::ofstream(file) << "\n{\"id\":\"x\"}\n";
  try {
    readCases(file);
    ADD_FAILURE() << "nothing thrown";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("broken_case.jsonl:2"), std::string::npos)
        << error.what();
  }
}

}  // namespace
}  // namespace enfilade::accuracy
