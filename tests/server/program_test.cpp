// The program itself, as its users start it: exit codes, what it says, what it writes.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "tests/server/small_room.hpp"

extern char** environ;

namespace enfilade::server::testing {
namespace {

namespace fs = std::filesystem;

constexpr const char* kWalk = R"({"spawn":"ann","at":[0,0.01,0],"facing":0}
{"spawn":"bob","at":[0,0.01,3],"facing":90}
{"walk":"ann","to":[9,0,0],"speed":3}
{"look":"ann","at":[0,1,6]}
{"capture":"ann","as":"wall"}
{"walk":"bob","along":[[3,0,3],[3,0,-3]],"speed":2}
{"wait":0.5}
{"leave":"bob"}
)";

std::string textOf(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

void write(const fs::path& file, const std::string& text) {
  std::ofstream(file, std::ios::binary) << text;
}

class Program : public ::testing::Test {
 protected:
  struct Ended {
    int code = -1;
    std::string out, err;
  };

  void SetUp() override {
    const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::temp_directory_path() /
              (std::string("enfilade_") + test->name() + "_" + std::to_string(::getpid()));
    fs::create_directories(folder_);
    write(folder_ / "room.obj", smallRoomObj());
    write(folder_ / "walk.jsonl", kWalk);
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::string path(const std::string& name) const { return (folder_ / name).string(); }

  pid_t start(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), ENFILADE_PROGRAM);
    std::vector<char*> argv;
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    const int flags = O_WRONLY | O_CREAT | O_TRUNC;
    posix_spawn_file_actions_addopen(&actions, 1, path("stdout").c_str(), flags, 0600);
    posix_spawn_file_actions_addopen(&actions, 2, path("stderr").c_str(), flags, 0600);
    pid_t child = -1;
    EXPECT_EQ(posix_spawn(&child, ENFILADE_PROGRAM, &actions, nullptr, argv.data(), environ), 0);
    posix_spawn_file_actions_destroy(&actions);
    return child;
  }

  static int codeOf(pid_t child) {
    int status = 0;
    waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  }

  Ended run(const std::vector<std::string>& arguments) const {
    const int code = codeOf(start(arguments));
    return {code, textOf(path("stdout")), textOf(path("stderr"))};
  }

  /// The port of the ready line, when it is there.
  int awaitReady() const {
    for (int i = 0; i < 3000; ++i) {
      const auto ready = nlohmann::json::parse(textOf(path("stdout")), nullptr, false);
      if (!ready.is_discarded() && ready.value("ready", false)) return ready.at("port");
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return 0;
  }

  fs::path folder_;
};

TEST_F(Program, UsageMistakesEndWithTwoAndSayHow) {
  const std::vector<std::vector<std::string>> mistakes{
      {},
      {"dance"},
      {"serve"},
      {"serve", "room.obj", "--lisen", "x"},
      {"serve", "room.obj", "--listen", "nowhere"},
      {"serve", "room.obj", "--listen", "127.0.0.1:70000"},
      {"replay", "room.obj", "walk.jsonl"},
      {"replay", "room.obj", "walk.jsonl", "--out", "out", "--unit", "-1"},
      {"replay", "room.obj", "walk.jsonl", "--out", "out", "--up", "w"},
      {"replay", "room.obj", "walk.jsonl", "--out", "out", "--audit", "1000001"},
      {"walk", "walk.jsonl", "--out", "out"}};
  for (const auto& arguments : mistakes) {
    const Ended ended = run(arguments);
    EXPECT_EQ(ended.code, 2) << ::testing::PrintToString(arguments);
    EXPECT_EQ(ended.out, "") << "stdout is for data";
    EXPECT_NE(ended.err.find("enfilade"), std::string::npos) << ended.err;
    EXPECT_NE(ended.err.find("--help"), std::string::npos) << ended.err;
    EXPECT_EQ(std::count(ended.err.begin(), ended.err.end(), '\n'), 2) << ended.err;
  }
  EXPECT_EQ(run({"--help"}).code, 0);
}

TEST_F(Program, WhatCannotBeReadEndsWithOneAndIsNamed) {
  const auto replay = [&](const std::string& scene, const std::string& script) {
    return run({"replay", scene, script, "--out", path("out")});
  };
  const Ended noScene = replay(path("absent.obj"), path("walk.jsonl"));
  EXPECT_EQ(noScene.code, 1);
  EXPECT_NE(noScene.err.find("absent.obj"), std::string::npos) << noScene.err;
  write(path("room.xyz"), smallRoomObj());
  const Ended unknown = replay(path("room.xyz"), path("walk.jsonl"));
  EXPECT_EQ(unknown.code, 1);
  EXPECT_NE(unknown.err.find("room.xyz"), std::string::npos) << unknown.err;
  EXPECT_NE(unknown.err.find(".xyz"), std::string::npos) << unknown.err;
  const Ended noScript = replay(path("room.obj"), path("absent.jsonl"));
  EXPECT_EQ(noScript.code, 1);
  EXPECT_NE(noScript.err.find("absent.jsonl"), std::string::npos) << noScript.err;
  write(path("bad.jsonl"), "{\"spawn\":\"ann\",\"at\":[0,0,0]}\n{\"walk\":\"ann\"}\n");
  const Ended badScript = replay(path("room.obj"), path("bad.jsonl"));
  EXPECT_EQ(badScript.code, 1);
  EXPECT_NE(badScript.err.find("bad.jsonl:2"), std::string::npos) << badScript.err;
  EXPECT_FALSE(fs::exists(path("out") + "/summary.json"));
}

TEST_F(Program, AFolderThatCannotBeWrittenIsToldBeforeTheWalk) {
  write(path("file"), "in the way");
  const Ended ended =
      run({"replay", path("room.obj"), path("walk.jsonl"), "--out", path("file") + "/out"});
  EXPECT_EQ(ended.code, 1);
  EXPECT_NE(ended.err.find("file/out"), std::string::npos) << ended.err;
  EXPECT_EQ(ended.out, "");
}

TEST_F(Program, ASecondWalkIntoAFolderRemovesWhatTheFirstWroteAndNothingElse) {
  const auto replay = [&](const std::string& script) {
    return run({"replay", path("room.obj"), path(script), "--out", path("out")}).code;
  };
  ASSERT_EQ(replay("walk.jsonl"), 0);
  write(path("out/sheet.png"), "of a first walk with a renderer");
  write(path("out/notes.txt"), "the visitor's own");
  write(path("out/frames/mine.png"), "the visitor's own");
  write(path("still.jsonl"), "{\"spawn\":\"ann\",\"at\":[0,0.01,0]}\n");
  ASSERT_EQ(replay("still.jsonl"), 0);
  EXPECT_FALSE(fs::exists(path("out/frames/wall.png")));
  EXPECT_FALSE(fs::exists(path("out/sheet.png"))) << "this walk took no picture";
  EXPECT_TRUE(fs::exists(path("out/summary.json")));
  EXPECT_TRUE(fs::exists(path("out/notes.txt")));
  EXPECT_TRUE(fs::exists(path("out/frames/mine.png")));
}

TEST_F(Program, ASummaryThatStdoutDoesNotTakeEndsWithOne) {
  fs::create_symlink("/dev/full", path("stdout"));
  const int code =
      codeOf(start({"replay", path("room.obj"), path("walk.jsonl"), "--out", path("out")}));
  EXPECT_EQ(code, 1);
  EXPECT_NE(textOf(path("stderr")).find("stdout"), std::string::npos) << textOf(path("stderr"));
}

TEST_F(Program, ServingAStrangersAddressEndsWithOne) {
  const Ended ended = run({"serve", path("room.obj"), "--listen", "0.0.0.0:0"});
  EXPECT_EQ(ended.code, 1);
  EXPECT_NE(ended.err.find("loopback"), std::string::npos) << ended.err;
}

TEST_F(Program, WalkingWithoutAServerEndsWithOne) {
  const Ended ended =
      run({"walk", path("walk.jsonl"), "--connect", "127.0.0.1:1", "--out", path("out")});
  EXPECT_EQ(ended.code, 1);
  EXPECT_NE(ended.err.find("127.0.0.1:1"), std::string::npos) << ended.err;
}

TEST_F(Program, SignalsEndAServerInOrder) {
  for (const auto& [signal, code] : {std::pair{SIGTERM, 0}, std::pair{SIGINT, 130}}) {
    fs::remove(path("stdout"));
    const pid_t child = start({"serve", path("room.obj"), "--listen", "127.0.0.1:0"});
    EXPECT_GT(awaitReady(), 0);
    kill(child, signal);
    EXPECT_EQ(codeOf(child), code);
  }
}

TEST_F(Program, StrictTurnsABlockedWalkIntoThree) {
  const auto arguments = [&](bool strict) {
    std::vector<std::string> all{"replay", path("room.obj"), path("walk.jsonl"), "--out",
                                 path("out")};
    if (strict) all.push_back("--strict");
    return all;
  };
  const Ended lenient = run(arguments(false));
  EXPECT_EQ(lenient.code, 0);
  EXPECT_FALSE(nlohmann::json::parse(lenient.out).contains("audit")) << "nobody asked for it";
  const Ended strict = run(arguments(true));
  EXPECT_EQ(strict.code, 3);
  EXPECT_NE(strict.err.find("room_wall"), std::string::npos) << strict.err;
}

/// contacts.jsonl, up to what ends when the walk does.
std::vector<nlohmann::json> contactsOf(const fs::path& out, std::uint64_t lastTick) {
  std::ifstream lines(out / "contacts.jsonl");
  std::vector<nlohmann::json> contacts;
  for (std::string line; std::getline(lines, line);) {
    auto contact = nlohmann::json::parse(line);
    const bool closing = contact.value("reason", "") == "shutdown" || contact["tick"] > lastTick;
    if (!closing) contacts.push_back(std::move(contact));
  }
  return contacts;
}

void expectBalanced(const fs::path& out) {
  std::ifstream lines(out / "contacts.jsonl");
  std::map<std::pair<std::string, std::string>, int> open;
  int begun = 0;
  for (std::string line; std::getline(lines, line);) {
    const auto contact = nlohmann::json::parse(line);
    for (const char* key : {"tick", "time", "event", "a", "b", "verdict", "distance", "point_a",
                            "point_b", "normal", "decided_by"}) {
      EXPECT_TRUE(contact.contains(key)) << key;
    }
    int& live = open[{contact["a"], contact["b"]}];
    if (contact["event"] == "begin") ++live, ++begun;
    if (contact["event"] == "end") --live;
    EXPECT_EQ(contact["event"] == "end", contact.contains("reason"));
    EXPECT_TRUE(live == 0 || live == 1);
    EXPECT_NE(contact["verdict"], "penetrating");
  }
  for (const auto& [pair, live] : open) EXPECT_EQ(live, 0) << pair.first << " " << pair.second;
  EXPECT_GE(begun, 3) << "two floors and a wall";
}

TEST_F(Program, AWalkOverTheSocketIsTheReplayToTheLastBit) {
  const Ended replayed = run(
      {"replay", path("room.obj"), path("walk.jsonl"), "--out", path("replayed"), "--audit", "10"});
  ASSERT_EQ(replayed.code, 0) << replayed.err;
  fs::remove(path("stdout"));
  const pid_t server =
      start({"serve", path("room.obj"), "--listen", "127.0.0.1:0", "--audit", "10"});
  const std::string port = std::to_string(awaitReady());
  const Ended walked =
      run({"walk", path("walk.jsonl"), "--connect", "127.0.0.1:" + port, "--out", path("walked")});
  kill(server, SIGTERM);
  EXPECT_EQ(codeOf(server), 0);
  ASSERT_EQ(walked.code, 0) << walked.err;

  const auto summary = nlohmann::json::parse(replayed.out);
  const auto socketSummary = nlohmann::json::parse(walked.out);
  EXPECT_EQ(summary, nlohmann::json::parse(textOf(path("replayed/summary.json"))));
  for (const char* key : {"ticks", "state_hash", "contacts", "worst_penetration", "pairs", "walks",
                          "outcomes", "scene_hash", "blocked", "arrived", "audit"}) {
    EXPECT_EQ(summary.at(key), socketSummary.at(key)) << key;
  }
  EXPECT_EQ(summary["state_hash"].get<std::string>().size(), 16u);
  EXPECT_EQ(summary["worst_penetration"], 0);
  EXPECT_EQ(summary["audit"]["ticks"], summary["ticks"].get<std::uint64_t>() / 10);
  EXPECT_GT(summary["audit"]["pairs"], summary["audit"]["ticks"]);
  EXPECT_EQ(summary["audit"]["missed"], 0);
  EXPECT_EQ(summary["audit"]["extra"], 0);
  for (const char* stage : {"commands", "broad", "avatars", "narrow", "hash", "snapshot"}) {
    EXPECT_TRUE(summary["stages_us"].contains(stage)) << stage;
  }
  const std::uint64_t last = summary["ticks"];
  EXPECT_EQ(contactsOf(path("replayed"), last), contactsOf(path("walked"), last));
  expectBalanced(path("replayed"));
  expectBalanced(path("walked"));
  if (summary["renderer"] == "") {
    if (std::getenv("CI")) FAIL() << "no EGL device";
    GTEST_SKIP() << "no EGL device: pictures are not compared";
  }
  for (const char* file : {"frames/wall.png", "sheet.png", "map.png"}) {
    EXPECT_FALSE(textOf(path("replayed/") + file).empty()) << file;
    EXPECT_EQ(textOf(path("replayed/") + file), textOf(path("walked/") + file)) << file;
  }
}

TEST_F(Program, InspectTellsAsJsonWhatIsInTheScene) {
  const Ended told = run({"inspect", path("room.obj"), "--json", "--unit", "m", "--objects"});
  ASSERT_EQ(told.code, 0) << told.err;
  const auto all = nlohmann::json::parse(told.out);
  EXPECT_EQ(all.at("objects"), 3);
  EXPECT_EQ(all.at("meshes"), 3);
  EXPECT_EQ(all.at("triangles"), all.at("unique_triangles"));
  EXPECT_EQ(all.at("convex_parts"), 3);
  EXPECT_EQ(all.at("unit"), 1);
  EXPECT_EQ(all.at("up"), "y");
  EXPECT_EQ(all.at("offset"), nlohmann::json({0.0, 0.0, 0.0}));
  EXPECT_EQ(all.at("bounds").at("size").at(0), 20);
  EXPECT_TRUE(all.at("bodies").is_array());
  EXPECT_TRUE(all.at("problems").empty()) << told.out;
  EXPECT_GT(all.at("import_seconds"), 0);
  EXPECT_GT(all.at("peak_mb"), 1);
  ASSERT_EQ(all.at("object_list").size(), 3u);
  EXPECT_EQ(all.at("object_list").at(1).at("path"), "room_wall");
  EXPECT_EQ(all.at("object_list").at(1).at("box").at("min").at(0), 5);
}

TEST_F(Program, InspectStrictEndsWithThreeWhenThereAreProblems) {
  EXPECT_EQ(run({"inspect", path("room.obj"), "--strict", "--unit", "m"}).code, 0);
  write(folder_ / "room.obj", smallRoomObj() + "o again\nf 1 2 3\nf 1 2 3\n");
  EXPECT_EQ(run({"inspect", path("room.obj"), "--unit", "m"}).code, 0);
  const Ended strict = run({"inspect", path("room.obj"), "--strict", "--unit", "m"});
  EXPECT_EQ(strict.code, 3);
  EXPECT_NE(strict.out.find("duplicate_triangle"), std::string::npos) << strict.out;
  EXPECT_LT(std::count(strict.out.begin(), strict.out.end(), '\n'), 40);
}

TEST_F(Program, InspectDrawsAPlanOfEachStorey) {
  const Ended drawn = run({"inspect", path("room.obj"), "--plan", path("plans")});
  ASSERT_EQ(drawn.code, 0) << drawn.err;
  EXPECT_TRUE(fs::exists(folder_ / "plans/storey-1.png"));
  EXPECT_FALSE(fs::exists(folder_ / "plans/storey-2.png"));
}

TEST_F(Program, ASecondStartReadsWhatTheFirstOneKept) {
  const auto fromCache = [&](const std::string& option) {
    const Ended told = run({"inspect", path("room.obj"), "--json", option});
    return nlohmann::json::parse(told.out).at("from_cache").get<bool>();
  };
  setenv("ENFILADE_CACHE", path("cache").c_str(), 1);
  EXPECT_FALSE(fromCache("--unit=m"));
  EXPECT_TRUE(fromCache("--unit=m"));
  EXPECT_FALSE(fromCache("--no-cache"));
  EXPECT_FALSE(fromCache("--unit=ft"));
  setenv("ENFILADE_CACHE", "off", 1);
  EXPECT_FALSE(fromCache("--unit=m"));
}

}  // namespace
}  // namespace enfilade::server::testing
