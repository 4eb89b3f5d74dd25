#include <gtest/gtest.h>

#include <array>
#include <cstdio>

#include "tests/protocol/fake_world.hpp"

namespace enfilade::protocol {
namespace {

Script parseTour(std::string_view text) {
  return parseScript(text, "tour.jsonl");
}

/// The ticks at which `world` received commands, with the commands' tags.
std::vector<std::string> findDiaryStarts(const FakeWorld& world) {
  std::vector<std::string> starts;
  for (const std::string& entry : world.getDiary()) {
    starts.push_back(entry.substr(0, entry.find(": ") + 2) +
                     entry.substr(entry.find("avatar"), entry.find(" tag") - entry.find("avatar")));
  }
  return starts;
}

TEST(RunScript, AllIsSubmittedUpToAGlobalWait) {
  FakeWorld world;
  const ScriptResult result = runScript(parseTour(R"({"spawn":"ann","at":[1,0,0]}
{"walk":"ann","along":[[2,0,0],[3,0,0]]}
{"spawn":"bob","at":[5,0,0]}
{"wait":0.1}
{"leave":"bob"}
{"leave":"ann"}
)"),
                                        world);
  // Ann: 1 + 10 ticks, then 6 of waiting, then one to leave.
  EXPECT_EQ(
      findDiaryStarts(world),
      (std::vector<std::string>{"0: avatar: \"ann\"", "0: avatar: \"ann\"", "0: avatar: \"bob\"",
                                "17: avatar: \"bob\"", "17: avatar: \"ann\""}));
  EXPECT_EQ(result.ticks, 18u);
  EXPECT_EQ(world.getTick(), 18u);
  EXPECT_DOUBLE_EQ(result.time, 18 / 60.0);
  EXPECT_EQ(result.spawned, 2u);
  EXPECT_EQ(result.arrived, 1u);
  EXPECT_TRUE(result.outcomes.empty());
}

TEST(RunScript, AGlobalWaitIsRoundedUpToTicksAndNotByRounding) {
  const auto countTicks = [](const std::string& seconds) {
    FakeWorld world;
    return runScript(parseTour("{\"wait\":" + seconds + "}"), world).ticks;
  };
  EXPECT_EQ(countTicks("0"), 0u);
  EXPECT_EQ(countTicks("1"), 60u);
  EXPECT_EQ(countTicks("0.1"), 6u);
  EXPECT_EQ(countTicks("0.35"), 21u);
  EXPECT_EQ(countTicks("0.0001"), 1u);
  EXPECT_EQ(countTicks("0.11"), 7u);
  for (int ticks = 1; ticks <= 600; ++ticks) {
    std::array<char, 32> seconds{};
    std::snprintf(seconds.data(), seconds.size(), "%.17g", ticks / 60.0);
    EXPECT_EQ(countTicks(seconds.data()), static_cast<std::uint64_t>(ticks));
  }
}

TEST(RunScript, AnAvatarsWaitHoldsUpOnlyThatAvatar) {
  FakeWorld world;
  std::map<std::string, std::uint64_t> arrivals;
  runScript(parseTour(R"({"spawn":"ann","at":[0,0,0]}
{"wait":0.5,"for":"ann"}
{"walk":"ann","to":[1,0,0]}
{"spawn":"bob","at":[0,0,0]}
{"walk":"bob","to":[1,0,0]}
)"),
            world, [&](StepOutcome& outcome, const ScriptProgress&) {
              for (const v1::Notice& notice : outcome.notices) {
                if (notice.kind() == v1::Notice::KIND_ARRIVED) {
                  arrivals[notice.avatar()] = outcome.tick;
                }
              }
            });
  EXPECT_EQ(arrivals.at("bob"), 6u);
  EXPECT_EQ(arrivals.at("ann"), 36u);
}

TEST(RunScript, AnEmptyScriptMakesNoTick) {
  FakeWorld world;
  EXPECT_EQ(runScript(parseTour("# nothing\n"), world).ticks, 0u);
}

TEST(RunScript, ARefusedCommandIsReportedWithItsLineAndTheScriptContinues) {
  FakeWorld world;
  const ScriptResult result = runScript(parseTour(R"({"spawn":"ann","at":[0,0,0]}

{"walk":"ann","to":[1,0,0],"speed":11}
{"walk":"ann","to":[2,0,0]}
)"),
                                        world);
  EXPECT_EQ(result.refused, 1u);
  EXPECT_EQ(result.arrived, 1u);
  ASSERT_EQ(result.outcomes.size(), 1u);
  EXPECT_EQ(result.outcomes[0].kind, LineOutcome::Kind::refused);
  EXPECT_EQ(result.outcomes[0].line, 3u);
  EXPECT_EQ(result.outcomes[0].text, "tour.jsonl:3: ann: refused: speed: too fast");
}

TEST(RunScript, ARefusedSpawnReportsTheDroppedLines) {
  FakeWorld world;
  const ScriptResult result = runScript(parseTour(R"({"spawn":"ghost","at":[0,0,0]}
{"walk":"ghost","to":[1,0,0]}
{"spawn":"ann","at":[0,0,0]}
{"walk":"ann","to":[1,0,0]}
)"),
                                        world);
  EXPECT_EQ(result.refused, 1u);
  EXPECT_EQ(result.dropped, 1u);
  EXPECT_EQ(result.arrived, 1u);
  ASSERT_EQ(result.outcomes.size(), 2u);
  EXPECT_EQ(result.outcomes[0].text, "tour.jsonl:1: ghost: refused: inside a wall");
  EXPECT_EQ(result.outcomes[0].tick, 1u);
  EXPECT_EQ(result.outcomes[1].line, 2u);
  EXPECT_EQ(result.outcomes[1].kind, LineOutcome::Kind::dropped);
}

TEST(RunScript, LinesAfterARefusedSpawnAreReportedInOneLine) {
  FakeWorld world;
  const ScriptResult result = runScript(parseTour(R"({"spawn":"ghost","at":[0,0,0]}
{"walk":"ghost","to":[1,0,0]}
{"wait":0.1}
{"look":"ghost","at":[1,0,0]}
{"wait":0.1}
{"leave":"ghost"}
)"),
                                        world);
  EXPECT_EQ(result.refused, 1u);
  EXPECT_EQ(result.dropped, 3u);
  ASSERT_EQ(result.outcomes.size(), 2u);
  EXPECT_EQ(
      result.outcomes[1].text,
      "tour.jsonl:2: ghost: not done: its spawn of line 1 was refused, and 2 more lines of this "
      "avatar were dropped");
}

TEST(RunScript, ABlockedWalkNamesItsObstacleAndTheNextCommandBegins) {
  FakeWorld world;
  const ScriptResult result = runScript(parseTour(R"({"spawn":"stuck","at":[4,0,0]}
{"walk":"stuck","to":[1,0,0]}
{"leave":"stuck"}
)"),
                                        world);
  EXPECT_EQ(result.blocked, 1u);
  EXPECT_EQ(result.arrived, 0u);
  EXPECT_EQ(result.ticks, 1u + FakeWorld::kStuckTicks + 1u);
  ASSERT_EQ(result.outcomes.size(), 1u);
  EXPECT_EQ(result.outcomes[0].text,
            "tour.jsonl:2: stuck: blocked by Hall/Table#2 at [4.00, 0.00, 0.00]");
}

TEST(RunScript, CapturesShowTheTickInWhichTheyRun) {
  FakeWorld world;
  std::vector<std::string> frames;
  const ScriptResult result =
      runScript(parseTour(R"({"spawn":"ann","at":[0,0,0]}
{"capture":"ann","as":"first"}
{"walk":"ann","to":[1,0,0]}
{"capture":"ann","as":"second"}
{"spawn":"blind","at":[0,0,0]}
{"capture":"blind","as":"none"}
)"),
                world, [&](StepOutcome& outcome, const ScriptProgress&) {
                  for (const CapturedFrame& frame : outcome.frames) {
                    EXPECT_EQ(frame.description.tick(), outcome.tick);
                    frames.push_back(std::to_string(outcome.tick) + " " + frame.name + " " +
                                     std::to_string(frame.tag));
                  }
                });
  EXPECT_EQ(frames, (std::vector<std::string>{"2 first 2", "2 none 6", "8 second 4"}));
  EXPECT_EQ(result.captured, 2u);
  EXPECT_EQ(result.uncaptured, 1u);
  ASSERT_EQ(result.outcomes.size(), 1u);
  EXPECT_EQ(result.outcomes[0].text, "tour.jsonl:6: blind: no picture \"none\": no renderer");
}

TEST(RunScript, AnEndlessWaitIsBoundedAndReported) {
  FakeWorld world;
  const ScriptResult result = runScript(parseTour(R"({"spawn":"restless","at":[0,0,0]}
{"wait":1}
{"leave":"restless"}
)"),
                                        world, {}, ScriptLimits{10});
  // Up to the bound, the wait itself, and up to the bound again.
  EXPECT_EQ(result.ticks, 600u + 60u + 600u);
  EXPECT_EQ(result.unfinished, 2u);
  ASSERT_EQ(result.outcomes.size(), 2u);
  EXPECT_EQ(result.outcomes[0].kind, LineOutcome::Kind::unfinished);
  EXPECT_EQ(result.outcomes[0].text,
            "tour.jsonl:2: after 10 s of simulated time an avatar still falls, or a body moves "
            "({\"body\":NAME,\"do\":\"stop\"} stops one); the script continues");
  EXPECT_EQ(result.outcomes[1].line, 3u);
}

TEST(RunScript, ProgressCountsEachLineOnce) {
  FakeWorld world;
  std::size_t last = 0;
  bool backwards = false;
  runScript(parseTour(R"({"spawn":"ann","at":[0,0,0]}
{"walk":"ann","to":[1,0,0],"speed":11}
{"wait":1}
{"spawn":"ghost","at":[0,0,0]}
{"walk":"ghost","to":[1,0,0]}
{"wait":1}
{"leave":"ann"}
)"),
            world, [&](StepOutcome&, const ScriptProgress& progress) {
              EXPECT_EQ(progress.lines, 7u);
              backwards = backwards || progress.linesDone < last;
              last = progress.linesDone;
            });
  EXPECT_FALSE(backwards);
  EXPECT_EQ(last, 7u);
}

TEST(RunScript, NoticesOfOthersEndNoLine) {
  struct Crowded : FakeWorld {
    StepOutcome step() override {
      StepOutcome outcome = FakeWorld::step();
      for (const std::uint64_t tag : {std::uint64_t{2}, (std::uint64_t{1} << 32) + 2}) {
        v1::Notice notice;
        notice.set_kind(v1::Notice::KIND_BLOCKED);
        notice.set_avatar(tag == 2 ? "stranger" : "ann");
        notice.set_tag(tag);
        outcome.notices.push_back(notice);
      }
      return outcome;
    }
  } world;
  const ScriptResult result = runScript(parseTour(R"({"spawn":"ann","at":[0,0,0]}
{"walk":"ann","to":[1,0,0]}
)"),
                                        world);
  EXPECT_EQ(result.blocked, 0u);
  EXPECT_EQ(result.arrived, 1u);
  EXPECT_TRUE(result.outcomes.empty());
}

TEST(RunScript, ExceptionsOfTheDriverPassThrough) {
  struct Broken : FakeWorld {
    StepOutcome step() override { throw std::runtime_error("gone"); }
  } world;
  EXPECT_THROW(runScript(parseTour(R"({"spawn":"ann","at":[0,0,0]})"), world), std::runtime_error);
}

}  // namespace
}  // namespace enfilade::protocol
