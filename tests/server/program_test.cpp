// Tests of the program as its users start it: exit codes, messages, output files.
#include "tests/server/program_fixture.hpp"

#include <sys/resource.h>

#include <algorithm>
#include <fstream>
#include <map>

#include "render/image/image.hpp"
#include "tests/scene/hand_made_files.hpp"

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

std::ptrdiff_t countDarkPixels(const std::string& file) {
  const std::string bytes = readText(file);
  const render::Image image = render::decodePng({bytes.begin(), bytes.end()});
  std::ptrdiff_t dark = 0;
  for (std::size_t i = 0; i < image.rgb.size(); i += 3) dark += image.rgb[i] < 80 ? 1 : 0;
  return dark;
}

class Program : public ProgramFixture {
 protected:
  void SetUp() override {
    ProgramFixture::SetUp();
    write(folder_ / "walk.jsonl", kWalk);
  }
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
  EXPECT_EQ(run({"help", "serve"}).out, run({"serve", "--help"}).out);
}

TEST_F(Program, UsageMistakesNameTheOptionAndWhatToGive) {
  struct Mistake {
    std::vector<std::string> arguments;
    std::string text;
  };
  const std::vector<Mistake> mistakes{
      {{"inspect", "a", "--plan-scale", "abc"}, "--plan-scale: abc: give N from 1 to 100000\n"},
      {{"inspect", "a", "--plan-format", "bmp"}, "--plan-format: bmp: give png, svg or pdf\n"},
      {{"inspect", "a", "--offset", "1,2"}, "--offset: give X,Y,Z\n"},
      {{"inspect", "a", "--offset", "1,2,x"}, "--offset: x: give a number\n"},
      {{"inspect", "a", "--plan"}, "--plan: give DIR\n"},
      {{"doctor", "nothere", "--device"}, "unknown option '--device'\n"},
      {{"doctor", "nothere"}, "unexpected argument 'nothere'; leave it out\n"},
      {{"serve", "a", "--token-file", "nothere"},
       "--token-file: nothere: no such file; check the path\n"},
      {{"serve", "a", "--port", "80"}, "unknown option '--port'; did you mean '--listen'?\n"},
      {{"serve", "a", "--step-height", "5"}, "--step-height: step height is 5 m; give 0 to 2 m\n"},
      {{"capture", "a", "--no-such"}, "unknown option '--no-such'"},
      {{"capture", "a", "--no-cach=1"}, "unknown option '--no-cach'; did you mean '--no-cache'?\n"},
      {{"capture", "a", "b"}, "--out is required: output folder for the frames\n"}};
  for (const Mistake& mistake : mistakes) {
    const Ended ended = run(mistake.arguments);
    EXPECT_EQ(ended.code, 2);
    EXPECT_EQ(ended.err.find("enfilade: " + mistake.text), 0u) << ended.err;
  }
}

TEST_F(Program, HelpMarksRequiredOptionsAndHasNoTypes) {
  const std::string walk = run({"walk", "--help"}).out, route = run({"route", "--help"}).out;
  EXPECT_NE(walk.find("--out DIR (required)"), std::string::npos) << walk;
  EXPECT_NE(walk.find("--connect HOST:PORT (required)"), std::string::npos) << walk;
  EXPECT_NE(route.find("--drop METRES (0)"), std::string::npos) << route;
}

TEST_F(Program, UnreadableFilesAreNamedAndExitWithOne) {
  const auto replay = [&](const std::string& scene, const std::string& script) {
    return run({"replay", scene, script, "--out", getPath("out")});
  };
  const Ended noScene = replay(getPath("absent.obj"), getPath("walk.jsonl"));
  EXPECT_EQ(noScene.code, 1);
  EXPECT_NE(noScene.err.find("absent.obj: no such file; check the path\n"), std::string::npos)
      << noScene.err;
  write(getPath("room.xyz"), makeSmallRoomObj());
  const Ended unknown = replay(getPath("room.xyz"), getPath("walk.jsonl"));
  EXPECT_EQ(unknown.code, 1);
  EXPECT_NE(unknown.err.find("room.xyz"), std::string::npos) << unknown.err;
  EXPECT_NE(unknown.err.find(".xyz"), std::string::npos) << unknown.err;
  const Ended noScript = replay(getPath("room.obj"), getPath("absent.jsonl"));
  EXPECT_EQ(noScript.code, 1);
  EXPECT_NE(noScript.err.find("absent.jsonl"), std::string::npos) << noScript.err;
  write(getPath("bad.jsonl"), "{\"spawn\":\"ann\",\"at\":[0,0,0]}\n{\"walk\":\"ann\"}\n");
  const Ended badScript = replay(getPath("room.obj"), getPath("bad.jsonl"));
  EXPECT_EQ(badScript.code, 1);
  EXPECT_NE(badScript.err.find("bad.jsonl:2"), std::string::npos) << badScript.err;
  EXPECT_FALSE(fs::exists(getPath("out") + "/summary.json"));
}

TEST_F(Program, AMissingDeviceExitsWithOne) {
  write(folder_ / "path.txt", "0 0 1 0 0 0 0 1\n");
  for (const std::vector<std::string>& verb : std::vector<std::vector<std::string>>{
           {"serve", getPath("room.obj"), "--listen", "127.0.0.1:0"},
           {"replay", getPath("room.obj"), getPath("walk.jsonl"), "--out", getPath("out")},
           {"capture", getPath("room.obj"), getPath("path.txt"), "--out", getPath("frames")}}) {
    std::vector<std::string> arguments = verb;
    arguments.insert(arguments.end(), {"--device", "abacus of 1642"});
    const Ended ended = run(arguments);
    EXPECT_EQ(ended.code, 1) << verb[0];
    EXPECT_NE(ended.err.find("abacus of 1642"), std::string::npos) << ended.err;
  }
  EXPECT_EQ(run({"replay", getPath("room.obj"), getPath("walk.jsonl"), "--out", getPath("out"),
                 "--renderer", "rays", "--require-gpu"})
                .code,
            1);
}

TEST_F(Program, TheRequestedRendererDrawsTheWalk) {
  const Ended ended = run({"replay", getPath("room.obj"), getPath("walk.jsonl"), "--out",
                           getPath("out"), "--renderer", "rays"});
  EXPECT_EQ(ended.code, 0) << ended.err;
  EXPECT_NE(ended.err.find("by Embree"), std::string::npos) << ended.err;
}

TEST_F(Program, AnUnwritableFolderIsReportedBeforeTheWalk) {
  write(getPath("file"), "in the way");
  const Ended ended = run(
      {"replay", getPath("room.obj"), getPath("walk.jsonl"), "--out", getPath("file") + "/out"});
  EXPECT_EQ(ended.code, 1);
  EXPECT_NE(ended.err.find("file/out: Not a directory; give another folder with --out\n"),
            std::string::npos)
      << ended.err;
  EXPECT_EQ(ended.out, "");
}

TEST_F(Program, ASecondWalkIntoAFolderRemovesOnlyTheFirstOnesFiles) {
  const auto replay = [&](const std::string& script) {
    return run({"replay", getPath("room.obj"), getPath(script), "--out", getPath("out")}).code;
  };
  ASSERT_EQ(replay("walk.jsonl"), 0);
  write(getPath("out/sheet.png"), "of a first walk with a renderer");
  write(getPath("out/notes.txt"), "the visitor's own");
  write(getPath("out/frames/mine.png"), "the visitor's own");
  write(getPath("still.jsonl"), "{\"spawn\":\"ann\",\"at\":[0,0.01,0]}\n");
  ASSERT_EQ(replay("still.jsonl"), 0);
  EXPECT_FALSE(fs::exists(getPath("out/frames/wall.png")));
  EXPECT_FALSE(fs::exists(getPath("out/sheet.png"))) << "this walk took no picture";
  EXPECT_TRUE(fs::exists(getPath("out/summary.json")));
  EXPECT_TRUE(fs::exists(getPath("out/notes.txt")));
  EXPECT_TRUE(fs::exists(getPath("out/frames/mine.png")));
}

TEST_F(Program, AFailedWriteToStdoutExitsWithOne) {
  write(folder_ / "path.txt", "0 0 1 0 0 0 0 1\n");
  fs::create_symlink("/dev/full", getPath("stdout"));
  for (const std::vector<std::string>& arguments : std::vector<std::vector<std::string>>{
           {"--help"},
           {"--version"},
           {"serve", getPath("room.obj"), "--listen", "127.0.0.1:0"},
           {"inspect", getPath("room.obj")},
           {"doctor"},
           {"replay", getPath("room.obj"), getPath("walk.jsonl"), "--out", getPath("out"),
            "--record", getPath("walk.mcap")},
           {"replay", getPath("room.obj"), getPath("walk.mcap"), "--verify"},
           {"replay", getPath("room.obj"), getPath("walk.mcap"), "--out", getPath("again")},
           {"inspect", getPath("walk.mcap")},
           {"diff", getPath("walk.mcap"), getPath("walk.mcap")},
           {"export", getPath("walk.mcap"), "--out", getPath("export")},
           {"capture", getPath("room.obj"), getPath("path.txt"), "--out", getPath("frames"),
            "--dry-run"},
           {"capture", getPath("room.obj"), getPath("path.txt"), "--out", getPath("frames"),
            "--size", "16x16", "--renderer", "rays"}}) {
    EXPECT_EQ(awaitExitCode(start(arguments)), 1) << ::testing::PrintToString(arguments);
    EXPECT_NE(readText(getPath("stderr")).find("stdout"), std::string::npos)
        << readText(getPath("stderr"));
  }
}

class DoctorBesideACrash : public ProgramFixture {
 protected:
  void SetUp() override {
    ProgramFixture::SetUp();
    write(vendor_, R"({"file_format_version":"1.0.0","ICD":{"library_path":")" ENFILADE_CRASHING_EGL
                   R"("}})");
  }

  /// The report with EGL drivers from `files` alone, separated by colons.
  nlohmann::json diagnose(const std::string& files, int code) const {
    setenv("__EGL_VENDOR_LIBRARY_FILENAMES", files.c_str(), 1);
    const Ended ended = run({"doctor", "--json"});
    unsetenv("__EGL_VENDOR_LIBRARY_FILENAMES");
    EXPECT_EQ(ended.code, code) << ended.err;
    return nlohmann::json::parse(ended.out);
  }

  const std::string vendor_ = getPath("vendor.json");
};

TEST_F(DoctorBesideACrash, NamesTheDriverThatCrashes) {
  const auto report = diagnose(vendor_, 1);
  EXPECT_EQ(report["vendors"][0]["failure"], "crashed (Aborted)");
  EXPECT_TRUE(report["devices"].empty());
  EXPECT_TRUE(report["remedy"].get<std::string>().ends_with(vendor_));
}

TEST_F(DoctorBesideACrash, TestsTheOtherDrivers) {
  const std::string mesa = "/usr/share/glvnd/egl_vendor.d/50_mesa.json";
  if (!std::filesystem::exists(mesa)) {
    ASSERT_EQ(std::getenv("CI"), nullptr) << "no " << mesa << ": install libegl-mesa0";
    GTEST_SKIP() << "no " << mesa << ": install libegl-mesa0";
  }
  const auto report = diagnose(vendor_ + ":" + mesa, 0);
  EXPECT_EQ(report["vendors"][0]["failure"], "crashed (Aborted)");
  EXPECT_EQ(report["vendors"][1]["failure"], "");
  ASSERT_FALSE(report["devices"].empty());
  EXPECT_EQ(report["devices"][0]["proof"], "right");
  EXPECT_TRUE(report["remedy"].get<std::string>().ends_with(vendor_));
}

TEST_F(Program, AFileBeyondTheLimitIsAnErrorNotADeath) {
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const rlimit few{2048, before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &few), 0);  // the program inherits it
  const pid_t child = start({"replay", getPath("room.obj"), getPath("walk.jsonl"), "--out",
                             getPath("out"), "--record", getPath("walk.mcap")});
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
  EXPECT_EQ(awaitExitCode(child), 1);
  EXPECT_NE(readText(getPath("stderr")).find("File too large"), std::string::npos)
      << readText(getPath("stderr"));
}

TEST_F(Program, ARecordingKeepsThatTheRequiredAppearanceIsIgnored) {
  std::string text = tests::makeGltfFile(tests::BoxMesh({1, 2, 3}), "0", tests::kOneNode);
  text.replace(0, 1, R"({"extensionsRequired":["KHR_materials_unlit"],)");
  write(folder_ / "unlit.gltf", text);
  const Ended refused = run({"inspect", getPath("unlit.gltf")});
  EXPECT_EQ(refused.code, 1);
  EXPECT_NE(refused.err.find("KHR_materials_unlit; --ignore-appearance"), std::string::npos)
      << refused.err;
  write(folder_ / "wait.jsonl", "{\"wait\":0.1}\n");
  EXPECT_EQ(run({"replay", getPath("unlit.gltf"), getPath("wait.jsonl"), "--ignore-appearance",
                 "--out", getPath("out"), "--record", getPath("unlit.mcap")})
                .code,
            0);
  EXPECT_EQ(run({"replay", getPath("unlit.mcap"), "--verify"}).code, 0);
  EXPECT_EQ(run({"replay", getPath("unlit.mcap"), "--from", "1", "--then", getPath("wait.jsonl"),
                 "--out", getPath("branch"), "--ignore-appearance"})
                .code,
            2);
  EXPECT_EQ(
      run({"replay", getPath("unlit.gltf"), getPath("unlit.mcap"), "--out", getPath("again")}).code,
      0)
      << "the later version of the model";
}

TEST_F(Program, ServingAPublicAddressExitsWithOne) {
  const Ended ended = run({"serve", getPath("room.obj"), "--listen", "0.0.0.0:0"});
  EXPECT_EQ(ended.code, 1);
  EXPECT_NE(ended.err.find("--token-file and --insecure"), std::string::npos) << ended.err;
}

TEST_F(Program, WalkingWithoutAServerEndsWithOne) {
  const Ended ended =
      run({"walk", getPath("walk.jsonl"), "--connect", "127.0.0.1:1", "--out", getPath("out")});
  EXPECT_EQ(ended.code, 1);
  EXPECT_NE(ended.err.find("127.0.0.1:1"), std::string::npos) << ended.err;
}

TEST_F(Program, SignalsEndAServerInOrder) {
  for (const auto& [signal, code] : {std::pair{SIGTERM, 0}, std::pair{SIGINT, 130}}) {
    fs::remove(getPath("stdout"));
    const pid_t child = start({"serve", getPath("room.obj"), "--listen", "127.0.0.1:0"});
    EXPECT_GT(awaitReady(), 0);
    kill(child, signal);
    EXPECT_EQ(awaitExitCode(child), code);
  }
}

TEST_F(Program, StrictTurnsABlockedWalkIntoThree) {
  const auto arguments = [&](bool strict) {
    std::vector<std::string> all{"replay", getPath("room.obj"), getPath("walk.jsonl"), "--out",
                                 getPath("out")};
    if (strict) all.push_back("--strict");
    return all;
  };
  const Ended lenient = run(arguments(false));
  EXPECT_EQ(lenient.code, 0);
  EXPECT_FALSE(nlohmann::json::parse(lenient.out).contains("audit")) << "it was not requested";
  const Ended strict = run(arguments(true));
  EXPECT_EQ(strict.code, 3);
  EXPECT_NE(strict.err.find("room_wall"), std::string::npos) << strict.err;
}

/// Reads contacts.jsonl, without the contacts that end with the walk.
std::vector<nlohmann::json> readContacts(const fs::path& out, std::uint64_t lastTick) {
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
    for (const char* key : {"feature_a", "feature_b"})
      EXPECT_TRUE((std::set<std::string>{"vertex", "edge", "face"}.contains(contact.at(key))))
          << key;
  }
  for (const auto& [pair, live] : open) EXPECT_EQ(live, 0) << pair.first << " " << pair.second;
  EXPECT_GE(begun, 3) << "two floors and a wall";
}

TEST_F(Program, AWalkOverTheSocketIsTheReplayToTheLastBit) {
  const Ended replayed = run({"replay", getPath("room.obj"), getPath("walk.jsonl"), "--out",
                              getPath("replayed"), "--audit", "10"});
  ASSERT_EQ(replayed.code, 0) << replayed.err;
  fs::remove(getPath("stdout"));
  const pid_t server =
      start({"serve", getPath("room.obj"), "--listen", "127.0.0.1:0", "--audit", "10"});
  const std::string port = std::to_string(awaitReady());
  const Ended walked = run({"walk", getPath("walk.jsonl"), "--connect", "127.0.0.1:" + port,
                            "--out", getPath("walked")});
  kill(server, SIGTERM);
  EXPECT_EQ(awaitExitCode(server), 0);
  ASSERT_EQ(walked.code, 0) << walked.err;

  const auto summary = nlohmann::json::parse(replayed.out);
  const auto socketSummary = nlohmann::json::parse(walked.out);
  EXPECT_EQ(summary, nlohmann::json::parse(readText(getPath("replayed/summary.json"))));
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
  EXPECT_EQ(readContacts(getPath("replayed"), last), readContacts(getPath("walked"), last));
  expectBalanced(getPath("replayed"));
  expectBalanced(getPath("walked"));
  if (summary["renderer"] == "") {
    if (std::getenv("CI")) FAIL() << "no EGL device";
    GTEST_SKIP() << "no EGL device: pictures are not compared";
  }
  for (const char* file : {"frames/wall.png", "sheet.png", "map.png"}) {
    EXPECT_FALSE(readText(getPath("replayed/") + file).empty()) << file;
    EXPECT_EQ(readText(getPath("replayed/") + file), readText(getPath("walked/") + file)) << file;
  }
  EXPECT_GT(countDarkPixels(getPath("walked/map.png")), 500) << "walls";
}

TEST_F(Program, ASecondStartReadsTheCacheOfTheFirst) {
  const auto fromCache = [&](const std::string& option) {
    const Ended ended = run({"inspect", getPath("room.obj"), "--json", option});
    return nlohmann::json::parse(ended.out).at("from_cache").get<bool>();
  };
  setenv("ENFILADE_CACHE", getPath("cache").c_str(), 1);
  EXPECT_FALSE(fromCache("--unit=m"));
  EXPECT_TRUE(fromCache("--unit=m"));
  EXPECT_FALSE(fromCache("--no-cache"));
  EXPECT_FALSE(fromCache("--unit=ft"));
  setenv("ENFILADE_CACHE", "off", 1);
  EXPECT_FALSE(fromCache("--unit=m"));
}

}  // namespace
}  // namespace enfilade::server::testing
