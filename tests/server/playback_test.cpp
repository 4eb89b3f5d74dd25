// Tests of recordings that start at a checkpoint: verified from there, and continued.
#include <set>

#include "protocol/recording/recording.hpp"
#include "tests/server/program_fixture.hpp"

namespace enfilade::server {
namespace {

using testing::ProgramFixture;
using testing::write;

/// Ann walks to and fro for a minute; a client that takes over finds her walking.
class ProgramPlayback : public ProgramFixture {
 protected:
  void SetUp() override {
    ProgramFixture::SetUp();
    std::string walk = R"({"spawn":"ann","at":[0,0,0]})"
                       "\n"
                       R"({"walk":"ann","along":[)";
    for (int i = 0; i < 6; ++i) walk += "[4,0,2],[-8,0,-3],";
    walk += "[0,0,0]]}\n";
    write(getPath("walk.jsonl"), walk);
    write(getPath("wait.jsonl"), "{\"wait\":10}\n");
    ASSERT_EQ(replay({getPath("room.obj"), getPath("walk.jsonl"), "--out", getPath("out"),
                      "--record", getPath("walk.mcap")})
                  .code,
              0);
  }
  Ended replay(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), "replay");
    return run(arguments);
  }
  Ended verify(const std::string& file, std::vector<std::string> more = {}) const {
    more.insert(more.begin(), {getPath(file), "--verify"});
    return replay(more);
  }
  static nlohmann::json readReport(const Ended& ended) {
    return nlohmann::json::parse(ended.out, nullptr, false);
  }
};

TEST_F(ProgramPlayback, IsVerifiedFromTheCheckpointBeforeATick) {
  const auto whole = readReport(verify("walk.mcap"));
  const std::uint64_t ticks = whole.value("ticks", 0u);
  ASSERT_GT(ticks, 2400u);
  const Ended late = verify("walk.mcap", {"--from", std::to_string(ticks - 100)});
  EXPECT_EQ(late.code, 0) << late.err;
  const auto report = readReport(late);
  const std::uint64_t began = report.value("from_checkpoint", 0u);
  EXPECT_GT(began, 0u);
  EXPECT_LE(began, ticks - 100);
  EXPECT_EQ(report.value("ticks", 0u), ticks - began);
  EXPECT_EQ(report.value("state_hash", ""), whole.value("state_hash", "-"));
}

TEST_F(ProgramPlayback, AContinuedWalkEndsIdentically) {
  const Ended branched =
      replay({getPath("walk.mcap"), "--from", "1500", "--then", getPath("wait.jsonl"), "--out",
              getPath("branch"), "--record", getPath("branch.mcap")});
  ASSERT_EQ(branched.code, 0) << branched.err;
  const auto whole = readReport(verify("branch.mcap"));
  EXPECT_GE(whole.value("ticks", 0u), 600u);
  // Ann continues her orders: after the same tick the recorded walk has the same hash.
  const std::uint64_t end = 1500 + whole.value("ticks", std::uint64_t{0});
  write(getPath("none.jsonl"), "{\"wait\":0}\n");
  const Ended other =
      replay({getPath("walk.mcap"), "--from", std::to_string(end), "--then", getPath("none.jsonl"),
              "--out", getPath("other"), "--record", getPath("other.mcap")});
  if (other.code == 0) {
    const auto made = readReport(verify("other.mcap"));
    EXPECT_EQ(made.value("ticks", 1u), 0u);
    EXPECT_EQ(made.value("state_hash", ""), whole.value("state_hash", "-"));
  } else {  // the branch continued beyond the recording's end
    EXPECT_NE(other.err.find("is not in it"), std::string::npos) << other.err;
  }
}

TEST_F(ProgramPlayback, ABranchIsARecordingThatCanBeSoughtAndLeftAgain) {
  write(getPath("bob.jsonl"), R"({"spawn":"bob","at":[-3,0,5]})"
                              "\n"
                              R"({"walk":"ann","along":[[0,0,2]]})"
                              "\n");
  ASSERT_EQ(replay({getPath("room.obj"), getPath("walk.mcap"), "--from", "700", "--then",
                    getPath("bob.jsonl"), "--out", getPath("b"), "--record", getPath("b.mcap")})
                .code,
            0);
  const auto whole = readReport(verify("b.mcap"));
  const auto part = readReport(verify("b.mcap", {"--from", "900"}));
  EXPECT_EQ(part.value("state_hash", ""), whole.value("state_hash", "-"));
  EXPECT_EQ(part.value("from_checkpoint", 0u), 700u);
  const Ended early = verify("b.mcap", {"--from", "699"});
  EXPECT_EQ(early.code, 1);
  EXPECT_NE(early.err.find("give one from 700"), std::string::npos) << early.err;
  EXPECT_EQ(replay({getPath("b.mcap"), "--from", "800", "--then", getPath("wait.jsonl"), "--out",
                    getPath("c"), "--record", getPath("c.mcap")})
                .code,
            0);
  EXPECT_EQ(verify("c.mcap").code, 0);
}

/// The contacts reported as active at the start of a recording; contacts that end must have begun.
std::set<std::pair<std::string, std::string>> readLivingContacts(const std::string& file) {
  protocol::RecordingReader reader(file);
  std::set<std::pair<std::string, std::string>> live, first;
  bool ticked = false;
  while (const auto item = reader.next()) {
    ticked = ticked || std::holds_alternative<v1::State>(*item);
    const auto* events = std::get_if<v1::TickEvents>(&*item);
    if (!events) continue;
    for (const v1::ContactEvent& event : events->contacts()) {
      const std::pair pair{event.a_name(), event.b_name()};
      const bool begins = event.kind() == v1::ContactEvent::KIND_BEGIN;
      const bool ends = event.kind() == v1::ContactEvent::KIND_END;
      EXPECT_TRUE(!begins || live.insert(pair).second) << event.ShortDebugString();
      EXPECT_TRUE(!ends || live.erase(pair) == 1) << event.ShortDebugString();
      EXPECT_TRUE(event.tick() >= 700 || !ticked) << event.ShortDebugString();
    }
    if (events->tick() == 700) first = live;
  }
  EXPECT_TRUE(live.empty());
  return first;
}

TEST_F(ProgramPlayback, ActiveContactsAreReportedAtTheStartOfABranch) {
  ASSERT_EQ(replay({getPath("walk.mcap"), "--from", "700", "--then", getPath("wait.jsonl"), "--out",
                    getPath("b"), "--record", getPath("b.mcap")})
                .code,
            0);
  EXPECT_TRUE(readLivingContacts(getPath("b.mcap")).contains({"ann", "room_floor"}));
  EXPECT_EQ(verify("b.mcap").code, 0);
}

TEST_F(ProgramPlayback, InvalidStartsAreRefusedWithTheReason) {
  const Ended beyond = verify("walk.mcap", {"--from", "100000000"});
  EXPECT_EQ(beyond.code, 1);
  EXPECT_NE(beyond.err.find("give one from 0 to"), std::string::npos) << beyond.err;
  write(getPath("other.obj"), "o floor\nv -9 0 -9\nv 9 0 -9\nv 9 0 9\nf 1 2 3\n");
  const Ended other =
      replay({getPath("other.obj"), getPath("walk.mcap"), "--verify", "--from", "2400"});
  EXPECT_NE(other.code, 0);
  EXPECT_NE(other.err.find("another scene"), std::string::npos) << other.err;
  EXPECT_EQ(replay({getPath("walk.mcap"), "--from", "5"}).code, 2);
  EXPECT_EQ(
      replay({getPath("walk.mcap"), "--then", getPath("wait.jsonl"), "--out", getPath("x")}).code,
      2);
  EXPECT_EQ(replay({getPath("walk.mcap"), "--from", "5", "--then", getPath("wait.jsonl"), "--out",
                    getPath("x"), "--epsilon", "0.001"})
                .code,
            2);
}

}  // namespace
}  // namespace enfilade::server
