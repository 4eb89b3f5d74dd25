// Tests of the program `enfilade capture` in the small room: shards, runs that are stopped or
// resumed, and errors.
#include <sys/resource.h>

#include "tests/server/body_room.hpp"
#include "tests/server/capture_fixture.hpp"

namespace enfilade::server::testing {
namespace {

TEST_F(Capture, ShardsMergeToExactlyTheUnshardedSet) {
  write(folder_ / "path.txt", makePathAhead(5));
  ASSERT_EQ(runCapture("path.txt", "whole").code, 0);
  ASSERT_EQ(runCapture("path.txt", "first", {"--shard", "0/2"}).code, 0);
  ASSERT_EQ(runCapture("path.txt", "second", {"--shard", "1/2"}).code, 0);
  EXPECT_EQ(readTree(folder_ / "first").size(), 3 + 3 * 3U);
  EXPECT_EQ(readTree(folder_ / "second").size(), 3 + 3 * 2U);
  fs::copy(folder_ / "first", folder_ / "merged", fs::copy_options::recursive);
  fs::copy(folder_ / "second", folder_ / "merged",
           fs::copy_options::recursive | fs::copy_options::overwrite_existing);
  EXPECT_EQ(readTree(folder_ / "merged"), readTree(folder_ / "whole"));
}

TEST_F(Capture, NoiseOfDepthIsThatOfSeedAndFrameInAllShards) {
  write(folder_ / "path.txt", makePathAhead(4));
  const auto capture = [&](const std::string& out, std::vector<std::string> options) {
    options.insert(options.end(), {"--channels", "depth,range"});
    ASSERT_EQ(runCapture("path.txt", out, options).code, 0);
  };
  const auto file = [&](const std::string& out, const char* name) {
    return readTree(folder_ / out).at(name);
  };
  capture("exact", {});
  capture("whole", {"--depth-noise", "7"});
  capture("first", {"--depth-noise", "7", "--shard", "0/2"});
  capture("second", {"--depth-noise", "7", "--shard", "1/2"});
  capture("other", {"--depth-noise", "8"});
  for (const char* name : {"depth/000000.npy", "depth/000002.npy"})
    EXPECT_EQ(file("first", name), file("whole", name)) << name;
  for (const char* name : {"depth/000001.npy", "depth/000003.npy"}) {
    EXPECT_EQ(file("second", name), file("whole", name)) << name;
    EXPECT_NE(file("whole", name), file("exact", name)) << name;
    EXPECT_NE(file("whole", name), file("other", name)) << name;
  }
  EXPECT_EQ(file("whole", "range/000001.npy"), file("exact", "range/000001.npy"));
  const Ended unlike = runCapture("path.txt", "whole", {"--channels", "depth,range"});
  EXPECT_EQ(unlike.code, 1);
  EXPECT_NE(unlike.err.find("contains another capture (depth_noise: 7 there, null now"),
            std::string::npos)
      << unlike.err;
}

TEST_F(Capture, OnlyAnEqualRunResumesAStoppedOne) {
  write(folder_ / "path.txt", makePathAhead(4));
  ASSERT_EQ(runCapture("path.txt", "out").code, 0);
  const auto whole = readTree(folder_ / "out");
  fs::remove(folder_ / "out/rgb/000001.png");
  fs::remove(folder_ / "out/depth/000003.npy");
  const Ended again = runCapture("path.txt", "out");
  ASSERT_EQ(again.code, 0) << again.err;
  EXPECT_EQ(json::parse(again.out).at("written"), 2);
  EXPECT_EQ(json::parse(again.out).at("already_there"), 2);
  EXPECT_EQ(readTree(folder_ / "out"), whole);
  const Ended other = runCapture("path.txt", "out", {"--size", "32x24"});
  EXPECT_EQ(other.code, 1);
  EXPECT_NE(other.err.find("contains another capture (lens: "), std::string::npos) << other.err;
  EXPECT_NE(other.err.find("--out"), std::string::npos);
  write(folder_ / "path.txt", makePathAhead(4) + "9 0 1.6 0 0 0 0 1\n");
  EXPECT_EQ(runCapture("path.txt", "out").code, 1);
  EXPECT_EQ(readTree(folder_ / "out"), whole);
  fs::remove(folder_ / "out/capture.json");
  EXPECT_NE(runCapture("path.txt", "out").err.find("that identifies them"), std::string::npos);
}

TEST_F(Capture, ALimitedRunContinuesWithoutLimit) {
  write(folder_ / "path.txt", makePathAhead(4));
  ASSERT_EQ(runCapture("path.txt", "out", {"--limit", "2"}).code, 0);
  const Ended all = runCapture("path.txt", "out");
  ASSERT_EQ(all.code, 0) << all.err;
  EXPECT_EQ(json::parse(all.out).at("already_there"), 2);
  ASSERT_EQ(runCapture("path.txt", "fresh").code, 0);
  EXPECT_EQ(readTree(folder_ / "out"), readTree(folder_ / "fresh"));
  const json made = json::parse(readText(folder_ / "out/capture.json"));
  EXPECT_EQ(made.at("names").at("scene"), "room.obj");
  EXPECT_EQ(made.at("names").at("path"), "path.txt");
}

TEST_F(Capture, ARunWithoutFramesReleasesTheFolder) {
  write(folder_ / "path.txt", makePathAhead(1));
  // 16 bits of the finest unit hold 7 cm, and everything visible is farther away.
  const std::vector<std::string> fine{"--channels", "depth",         "--depth",
                                      "png",        "--depth-scale", "1000000"};
  const Ended refused = runCapture("path.txt", "out", fine);
  EXPECT_EQ(refused.code, 1);
  EXPECT_NE(refused.err.find("--too-far clamp"), std::string::npos) << refused.err;
  std::vector<std::string> clamped = fine;
  clamped.insert(clamped.end(), {"--too-far", "clamp"});
  EXPECT_EQ(runCapture("path.txt", "out", clamped).code, 0);
  EXPECT_EQ(runCapture("path.txt", "out", fine).code, 1) << "the folder now holds a frame";
}

TEST_F(Capture, PicturesAreTheSameForAnyNumberOfThreadsOfGl) {
  write(folder_ / "path.txt", makePathAhead(3));
  std::map<std::string, std::string> first;
  for (const char* threads : {"0", "1", "2"}) {
    ::setenv("LP_NUM_THREADS", threads, 1);  // only for Mesa's llvmpipe; other drivers ignore it
    const std::string out = std::string("out") + threads;
    const Ended ended = runCapture("path.txt", out,
                                   {"--size", "320x240", "--renderer", "gl", "--overlay", "boxes",
                                    "--channels", "rgb,depth,ids,normals"});
    EXPECT_EQ(ended.code, 0) << ended.err;
    const auto tree = readTree(folder_ / out);
    EXPECT_GE(tree.size(), 3 * 5U);
    if (first.empty()) first = tree;
    EXPECT_EQ(tree, first) << threads << " threads";
  }
  ::unsetenv("LP_NUM_THREADS");
}

TEST_F(Capture, TimeOfThePathPassesInTheWorldAndShardsShowTheSame) {
  write(folder_ / "room.walk.json",
        R"({"walk":1,"bodies":[{"name":"wall","kind":"path","objects":["room_wall"],
            "keys":[{"time":0},{"time":2,"offset":[2,0,0]}]}]})");
  const std::string pose = " 0 1.6 0 0 -0.7071067811865476 0 0.7071067811865476\n";
  write(folder_ / "path.txt", "100" + pose + "100.5" + pose + "101" + pose);
  ASSERT_EQ(runCapture("path.txt", "whole").code, 0);
  ASSERT_EQ(runCapture("path.txt", "still", {"--still"}).code, 0);
  const auto ahead = [&](const std::string& out, int frame) {
    const std::string file = out + "/depth/00000" + std::to_string(frame) + ".npy";
    return readNpy<float>(folder_ / file).at(32, 24);
  };
  for (int frame = 0; frame < 3; ++frame) {
    EXPECT_NEAR(ahead("whole", frame), 5 + 0.5 * frame, 0.02) << frame;  // a tick is 1/60 s
    EXPECT_NEAR(ahead("still", frame), 5, 1e-3) << frame;
  }
  for (const char* shard : {"0/2", "1/2"})
    ASSERT_EQ(runCapture("path.txt", "shards", {"--shard", shard}).code, 0);
  EXPECT_EQ(readTree(folder_ / "shards"), readTree(folder_ / "whole"));
}

TEST_F(Capture, AFullDiskLeavesOnlyCompleteFilesAndIsReported) {
  write(folder_ / "path.txt", makePathAhead(3));
  // A .npy of 64 x 48 floats has 12,416 bytes; the .png of the same image and all else fit.
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const rlimit little{8192, before.rlim_max};
  setrlimit(RLIMIT_FSIZE, &little);
  const pid_t child = start({"capture", getPath("room.obj"), getPath("path.txt"), "--out",
                             getPath("out"), "--size", "64x48", "--no-cache", "--no-mp4"});
  setrlimit(RLIMIT_FSIZE, &before);
  EXPECT_EQ(awaitExitCode(child), 1);
  EXPECT_NE(readText(getPath("stderr")).find("cannot write " + getPath("out") + "/depth/00000"),
            std::string::npos)
      << readText(getPath("stderr"));
  for (const auto& [name, text] : readTree(folder_ / "out")) {
    EXPECT_EQ(name.find(".part"), std::string::npos) << name;
    EXPECT_FALSE(text.empty()) << name;
  }
  EXPECT_FALSE(fs::exists(folder_ / "out/depth/000000.npy"));
  EXPECT_EQ(runCapture("path.txt", "out").code, 0);
  ASSERT_EQ(runCapture("path.txt", "fresh").code, 0);
  EXPECT_EQ(readTree(folder_ / "out"), readTree(folder_ / "fresh"));
}

TEST_F(Capture, AnInterruptEndsItWith130AndWholeFiles) {
  write(folder_ / "path.txt", makePathAhead(4000));
  for (const int signal : {SIGINT, SIGTERM}) {
    fs::remove_all(folder_ / "out");
    const pid_t child = start({"capture", getPath("room.obj"), getPath("path.txt"), "--out",
                               getPath("out"), "--size", "64x48", "--progress", "json"});
    for (int i = 0; i < 3000 && !fs::exists(folder_ / "out/ids/000003.npy"); ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    kill(child, signal);
    EXPECT_EQ(awaitExitCode(child), 130) << readText(getPath("stderr"));
    const auto tree = readTree(folder_ / "out");
    EXPECT_GT(tree.size(), 3 + 3 * 3U);
    EXPECT_LT(tree.size(), 3 + 3 * 4000U);
    for (const auto& [name, text] : tree) EXPECT_EQ(name.find(".part"), std::string::npos) << name;
    EXPECT_EQ(readText(getPath("stdout")), "");
    EXPECT_NE(readText(getPath("stderr")).find("continues from there"), std::string::npos);
    EXPECT_NE(readText(getPath("stderr")).find("{\"frames\":"), std::string::npos);
  }
}

TEST_F(Capture, FfmpegMakesTheFilmWhenAllFramesAreThere) {
  fs::create_directories(folder_ / "bin");
  write(folder_ / "bin/ffmpeg", "#!/bin/sh\nfor last; do :; done\necho \"$@\" > \"$last\"\n");
  fs::permissions(folder_ / "bin/ffmpeg", fs::perms::owner_all);
  const std::string before = getenv("PATH") ? getenv("PATH") : "";
  setenv("PATH", (getPath("bin") + ":" + before).c_str(), 1);
  write(folder_ / "path.txt", makePathAhead(4));
  film_ = true;
  const Ended half = runCapture("path.txt", "out", {"--shard", "0/2", "--channels", "rgb"});
  EXPECT_TRUE(json::parse(half.out).at("video").is_null());
  const Ended all = runCapture("path.txt", "out", {"--channels", "rgb"});
  setenv("PATH", before.c_str(), 1);
  EXPECT_EQ(json::parse(all.out).at("video"), "video.mp4") << all.err;
  EXPECT_NE(readText(folder_ / "out/video.mp4").find("-framerate 30 "), std::string::npos)
      << readText(folder_ / "out/video.mp4");
}

TEST_F(Capture, ADryRunReportsAndWritesNothing) {
  write(folder_ / "path.txt", makePathAhead(5));
  const Ended ended =
      runCapture("path.txt", "out", {"--dry-run", "--shard", "1/2", "--limit", "4"});
  ASSERT_EQ(ended.code, 0) << ended.err;
  EXPECT_EQ(json::parse(ended.out).at("frames"), 4);
  EXPECT_EQ(json::parse(ended.out).at("shard_frames"), 2);
  EXPECT_FALSE(fs::exists(folder_ / "out"));
}

TEST_F(Capture, ErrorsAreReportedBeforeAnyOutput) {
  write(folder_ / "path.txt", makePathAhead(1));
  for (const std::vector<std::string>& wrong : {std::vector<std::string>{"--size", "0x10"},
                                                {"--size", "100000x10"},
                                                {"--size", "64"},
                                                {"--fov", "180"},
                                                {"--intrinsics", "1,2,3"},
                                                {"--shard", "2/2"},
                                                {"--channels", "rgb,foo"},
                                                {"--channels", ""},
                                                {"--fov", "60", "--intrinsics", "9,9,9,9"},
                                                {"--quality", "0"},
                                                {"--near", "nan"}}) {
    const Ended ended = runCapture("path.txt", "out", wrong);
    EXPECT_EQ(ended.code, 2) << wrong[0] << " " << wrong[1] << ended.err;
  }
  write(folder_ / "nan.txt", "0 nan 0 0 0 0 0 1\n");
  const Ended ended = runCapture("nan.txt", "out");
  EXPECT_EQ(ended.code, 1);
  EXPECT_NE(ended.err.find("nan.txt:1: 'nan'"), std::string::npos) << ended.err;
  EXPECT_EQ(runCapture("missing.txt", "out").code, 1);
  EXPECT_EQ(runCapture("path.txt", "out", {"--near", "5", "--far", "4"}).code, 1);
  EXPECT_TRUE(readTree(folder_ / "out").empty());
}

}  // namespace
}  // namespace enfilade::server::testing
