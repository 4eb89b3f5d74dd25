// Tests of the program's walk with bodies: script commands to bodies, and their contacts in
// contacts.jsonl.
#include <map>

#include "tests/server/program_fixture.hpp"

namespace enfilade::server::testing {
namespace {

constexpr const char* kSidecar = R"({"walk": 1, "bodies": [
  {"name": "gate", "kind": "sliding", "objects": ["room_wall"], "axis": [0, 0, 1],
   "limits": [0, 9], "speed": 3},
  {"name": "crate", "kind": "rigid", "objects": ["room_column"], "density": 300},
  {"name": "door mat", "kind": "trigger", "box": [[1, 0, -1], [2, 2, 1]]}
]})";

constexpr const char* kWalkToBodies = R"({"spawn":"ann","at":[0,0.01,0]}
{"body":"gate","to":8.5,"speed":4}
{"wait":0.5}
{"walk":"ann","to":[8,0,0],"speed":3}
{"wait":0}
{"body":"gate","do":"close"}
{"body":"gate","level":1}
{"body":"dragon","do":"open"}
{"wait":0}
)";

class WalkBodies : public ProgramFixture {
 protected:
  void SetUp() override {
    ProgramFixture::SetUp();
    write(folder_ / "room.walk.json", kSidecar);
    write(folder_ / "walk.jsonl", kWalkToBodies);
  }
  std::vector<nlohmann::json> readContacts(const std::string& out) const {
    std::vector<nlohmann::json> all;
    std::ifstream lines(folder_ / out / "contacts.jsonl");
    for (std::string line; std::getline(lines, line);) all.push_back(nlohmann::json::parse(line));
    return all;
  }
};

std::uint64_t findTick(const std::vector<nlohmann::json>& contacts, const std::string& event,
                       const std::string& a, const std::string& b) {
  for (const auto& contact : contacts)
    if (contact["event"] == event && contact["a"] == a && contact["b"] == b) return contact["tick"];
  return 0;
}

TEST_F(WalkBodies, AreInTheContactsAndEqualOverTheSocket) {
  const Ended replayed =
      run({"replay", getPath("room.obj"), getPath("walk.jsonl"), "--out", getPath("a")});
  ASSERT_EQ(replayed.code, 0) << replayed.err;
  const auto events = readContacts("a");
  const std::uint64_t enters = findTick(events, "enter", "ann", "door mat");
  const std::uint64_t leaves = findTick(events, "leave", "ann", "door mat");
  EXPECT_GT(enters, 30u) << "she waits until the gate is open";
  EXPECT_GT(leaves, enters + 20) << "1.6 m at 3 m/s";
  EXPECT_GT(findTick(events, "begin", "crate", "room_floor"), 0u);
  const auto summary = nlohmann::json::parse(replayed.out);
  EXPECT_EQ(summary["arrived"], 1) << "the gate is out of the way";
  EXPECT_EQ(summary["refused"], 2) << "a gate has no levels, and there is no dragon";
  EXPECT_EQ(summary["worst_penetration"], 0);
  EXPECT_NE(replayed.err.find("walk.jsonl:7"), std::string::npos) << replayed.err;
  EXPECT_NE(replayed.err.find("dragon"), std::string::npos) << replayed.err;

  std::filesystem::remove(getPath("stdout"));
  const pid_t server = start({"serve", getPath("room.obj"), "--listen", "127.0.0.1:0"});
  const std::string port = std::to_string(awaitReady());
  const Ended walked =
      run({"walk", getPath("walk.jsonl"), "--connect", "127.0.0.1:" + port, "--out", getPath("b")});
  kill(server, SIGTERM);
  EXPECT_EQ(awaitExitCode(server), 0);
  ASSERT_EQ(walked.code, 0) << walked.err;
  const auto over = nlohmann::json::parse(walked.out);
  for (const char* key : {"ticks", "state_hash", "contacts", "refused", "arrived", "outcomes"})
    EXPECT_EQ(summary.at(key), over.at(key)) << key;
  EXPECT_EQ(findTick(readContacts("b"), "enter", "ann", "door mat"), enters);
  EXPECT_EQ(findTick(readContacts("b"), "leave", "ann", "door mat"), leaves);
}

TEST_F(WalkBodies, AnInvalidSidecarIsReportedWithItsPlaceAndNothingIsServed) {
  write(folder_ / "room.walk.json", R"({"walk": 1, "bodies": [{"name": "g", "kind": "hinged",
    "objects": ["room_wall"], "anchor": [0, 0, null]}]})");
  const Ended ended = run({"inspect", getPath("room.obj")});
  EXPECT_EQ(ended.code, 1);
  EXPECT_EQ(ended.out, "");
  EXPECT_NE(ended.err.find("room.walk.json.bodies[0].anchor"), std::string::npos) << ended.err;
}

}  // namespace
}  // namespace enfilade::server::testing
