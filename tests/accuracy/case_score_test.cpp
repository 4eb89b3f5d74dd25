// The score must see what is wrong: right answers are spoilt, one number each.
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

Case apart() {
  Case asked;
  asked.id = "apart", asked.family = "test";
  asked.a.points = asked.b.points = kCube;
  asked.b.translation = {3, 0, 0};
  asked.clearance = 1.5;
  asked.truth.verdict = "separated", asked.truth.distance = "2", asked.truth.near = true;
  return asked;
}

Case inside() {
  Case asked = apart();
  asked.b.translation = {0.75, 0.125, 0};
  asked.truth.verdict = "penetrating", asked.truth.distance = "0", asked.truth.penetration = "0.25";
  return asked;
}

Answer answerTo(const Case& asked, Level level) {
  Warmth cold;
  return answerCase(asked, {}, level, cold);
}

bool passes(const Case& asked, const Answer& answer, Level level) {
  Score score;
  addToScore(asked, answer, level, {}, score);
  return holds(score);
}

TEST(Score, RightAnswersPass) {
  for (const Level level : {Level::decide, Level::refine}) {
    EXPECT_TRUE(passes(apart(), answerTo(apart(), level), level));
    EXPECT_TRUE(passes(inside(), answerTo(inside(), level), level));
  }
}

TEST(Score, EverySpoiltAnswerFails) {
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
    Answer answer = answerTo(apart(), Level::refine);
    spoil(answer);
    EXPECT_FALSE(passes(apart(), answer, Level::refine)) << name;
  }
}

TEST(Score, ASpoiltDepthFails) {
  Answer refined = answerTo(inside(), Level::refine);
  *refined.penetration *= 1 + 1e-11;
  EXPECT_FALSE(passes(inside(), refined, Level::refine));
  Answer decided = answerTo(inside(), Level::decide);
  decided.depthIsGlobal = true;
  *decided.penetration += 1.01 * decided.errorBound + 0x1p-50;
  EXPECT_FALSE(passes(inside(), decided, Level::decide));
}

TEST(Score, ABoundThatIsTooWideOrTooNarrowFails) {
  Answer answer = answerTo(apart(), Level::decide);
  answer.errorBound = 17 * 0x1p-53 * 4;
  EXPECT_FALSE(passes(apart(), answer, Level::decide));
  answer.errorBound = 0;
  answer.distance = 2 + 0x1p-51;
  EXPECT_FALSE(passes(apart(), answer, Level::decide));
}

TEST(Score, ATimeOfImpactMustHoldTheTruthAndBeNarrow) {
  Case asked = apart();
  asked.course = Course{{1, 0, 0}, Vec3::Zero()};
  asked.truth.tc = "2";
  asked.truth.toi = {2 - 0x1p-52, 2};
  const Answer right = answerTo(asked, Level::refine);
  EXPECT_TRUE(passes(asked, right, Level::refine));
  for (const std::array<double, 2> wrong :
       {std::array{1.9, 2.1}, {2 + 1e-13, 2 + 2e-13}, {2 - 2e-13, 2 - 1e-13}}) {
    Answer answer = right;
    answer.toi = wrong;
    EXPECT_FALSE(passes(asked, answer, Level::refine));
  }
  for (const double tc : {0.0, 1.9, 2 + 0x1p-51}) {
    Answer answer = right;
    answer.tc = tc;
    EXPECT_FALSE(passes(asked, answer, Level::refine)) << tc;
  }
  Answer missed = right;
  missed.toi.reset();
  EXPECT_FALSE(passes(asked, missed, Level::refine));
}

TEST(CaseFile, ALineIsReadAndAnsweredInTheFormatAskedFor) {
  const auto file = tests::ownFile("one_case.jsonl");
  std::ofstream(file) << R"({"id":"x-1","family":"f","a":[[0,0,0],[1,0,0]],"b":[[0,0,2]],)"
                      << R"("pose_a":[1,0,0,0,0,1,0,0,0,0,1,0],"pose_b":[1,0,0,0,0,1,0,0,0,0,1,0],)"
                      << R"("verdict":"separated","distance":"2","penetration":null,"seq":4})"
                      << "\n\n";
  const std::vector<Case> cases = readCases(file);
  ASSERT_EQ(cases.size(), 1u);
  EXPECT_EQ(cases[0].sequence, 4);
  Answer answer = answerTo(cases[0], Level::refine);
  EXPECT_TRUE(passes(cases[0], answer, Level::refine));
  answer.nanoseconds = 5;
  EXPECT_EQ(
      jsonLine(cases[0], answer),
      R"({"id":"x-1","verdict":"separated","distance":2,"penetration":null,"depth_is":null,)"
      R"("near":null,"point_a":[0,0,0],"point_b":[0,0,2],"error_bound":)" +
          jsonLine(cases[0], answer).substr(jsonLine(cases[0], answer).find("error_bound") + 13));
}

TEST(CaseFile, ABrokenLineIsNamed) {
  const auto file = tests::ownFile("broken_case.jsonl");
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
