// Tests of the program `enfilade capture` in the small room: content of the output folder.
#include <sys/resource.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <map>

#include "render/gl/gl_renderer.hpp"
#include "render/image/image.hpp"
#include "server/capture/metadata_files.hpp"
#include "server/capture/overlay.hpp"
#include "server/floors/label_names.hpp"
#include "tests/server/body_room.hpp"
#include "tests/server/program_fixture.hpp"

namespace enfilade::server::testing {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// An array of a .npy file, as stored.
template <class Value>
struct Array {
  int height = 0, width = 0;
  std::vector<Value> values;

  const Value& at(int x, int y) const {
    return values.at(static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                     static_cast<std::size_t>(x));
  }
};

template <class Value>
Array<Value> readNpy(const fs::path& file) {
  const std::string bytes = readText(file);
  Array<Value> array;
  const std::size_t shape = bytes.find("'shape': (");
  if (shape == std::string::npos) return array;
  std::sscanf(bytes.c_str() + shape, "'shape': (%d, %d", &array.height, &array.width);
  const std::size_t start = bytes.find('\n') + 1;
  array.values.resize((bytes.size() - start) / sizeof(Value));
  std::memcpy(array.values.data(), bytes.data() + start, bytes.size() - start);
  return array;
}

/// Content of every file below the folder, by name.
std::map<std::string, std::string> readTree(const fs::path& folder) {
  std::map<std::string, std::string> tree;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file())
      tree[entry.path().lexically_relative(folder).generic_string()] = readText(entry.path());
  }
  return tree;
}

std::vector<std::string> getNames(const std::map<std::string, std::string>& tree) {
  std::vector<std::string> names;
  for (const auto& [name, text] : tree) names.push_back(name);
  return names;
}

bool picturesCanBeHad() {
  static const bool can = [] {
    try {
      render::GlRenderer renderer(smallRoom());
      return true;
    } catch (const render::RenderError&) {
      return false;
    }
  }();
  return can;
}

/// A path of `poses` poses along +x from x = 0, 0.2 m apart, at eye height, looking along +x; 30 a
/// second.
std::string ahead(int poses) {
  std::ostringstream text;
  for (int i = 0; i < poses; ++i)
    text << i / 30.0 << " " << 0.2 * i << " 1.6 0 0 -0.7071067811865476 0 0.7071067811865476\n";
  return text.str();
}

class Capture : public ProgramFixture {
 protected:
  void SetUp() override {
    if (!picturesCanBeHad()) {
      ASSERT_EQ(std::getenv("CI"), nullptr) << "no EGL device: install libegl-mesa0";
      GTEST_SKIP() << "no EGL device: install libegl-mesa0";
    }
    ProgramFixture::SetUp();
  }

  Ended captured(const std::string& pathFile, const std::string& out,
                 std::vector<std::string> options = {}) const {
    std::vector<std::string> arguments{"capture", path("room.obj"), path(pathFile), "--out",
                                       path(out)};
    if (!film_) options.push_back("--no-mp4");
    if (std::find(options.begin(), options.end(), "--size") == options.end())
      options.insert(options.end(), {"--size", "64x48"});
    arguments.insert(arguments.end(), options.begin(), options.end());
    return run(arguments);
  }

  bool film_ = false;  ///< whether ffmpeg is available
};

TEST_F(Capture, FilesFollowTheLayoutAndHoldTheImages) {
  write(folder_ / "path.txt", ahead(2));
  const Ended ended = captured("path.txt", "out", {"--fov", "90"});
  ASSERT_EQ(ended.code, 0) << ended.err;
  EXPECT_EQ(getNames(readTree(folder_ / "out")),
            (std::vector<std::string>{"capture.json", "depth/000000.npy", "depth/000001.npy",
                                      "ids/000000.npy", "ids/000001.npy", "instances.json",
                                      "rgb/000000.png", "rgb/000001.png", "transforms.json"}));
  const auto summary = json::parse(ended.out);
  EXPECT_EQ(summary.at("written"), 2);
  const auto depth = readNpy<float>(folder_ / "out/depth/000001.npy");
  const auto ids = readNpy<std::uint32_t>(folder_ / "out/ids/000001.npy");
  ASSERT_EQ(depth.values.size(), 64U * 48U);
  EXPECT_EQ(depth.width, 64);
  EXPECT_NEAR(depth.at(32, 24), 4.8, 1e-3);  // the wall's face is at x = 5, the eye at 0.2
  EXPECT_EQ(ids.at(32, 24), kWall);
  EXPECT_EQ(ids.at(32, 47), kFloor);
  EXPECT_EQ(ids.at(0, 0), 0U);  // past the wall's end and above its top
  EXPECT_TRUE(std::isnan(depth.at(0, 0)));
  const auto instances = json::parse(readText(folder_ / "out/instances.json"));
  EXPECT_EQ(instances.at("2").at("path"), "room_wall");
}

TEST(Instances, DescribeAnIfcProductAndItsOperation) {
  scene::Model model = bodyRoomModel();
  scene::Object& leaf = model.objects[kLeaf - 1];
  leaf.globalId = "2O2Fr$t4X7Zf8NOew3FNtn";
  leaf.ifcClass = "IfcDoor";
  leaf.operationType = "SINGLE_SWING_LEFT";
  const auto instances = json::parse(makeInstancesJson(model, {}));
  EXPECT_EQ(instances.at(std::to_string(kLeaf)), json({{"path", "leaf"},
                                                       {"global_id", "2O2Fr$t4X7Zf8NOew3FNtn"},
                                                       {"class", "IfcDoor"},
                                                       {"class_id", 1},
                                                       {"thing", kLeaf},
                                                       {"operation", "SINGLE_SWING_LEFT"},
                                                       {"body", "door"}}));
  EXPECT_EQ(instances.at(std::to_string(kEnd)), json({{"path", "end"}, {"thing", kEnd}}));
}

TEST_F(Capture, TransformsSayWhereAPixelLies) {
  write(folder_ / "path.json",
        R"([{"eye":[0,1.6,0],"look_at":[5,1,1]},{"eye":[-2,2.2,-1.5],"look_at":[5,1,0]}])");
  ASSERT_EQ(captured("path.json", "out", {"--intrinsics", "40,50,30,25"}).code, 0);
  const auto file = json::parse(readText(folder_ / "out/transforms.json"));
  struct View {
    Eigen::Matrix4d worldFromCamera;
    Array<float> depth;
    Array<std::uint32_t> ids;
  };
  std::vector<View> views;
  for (const auto& frame : file.at("frames")) {
    View view;
    for (int row = 0; row < 4; ++row)
      for (int column = 0; column < 4; ++column)
        view.worldFromCamera(row, column) = frame.at("transform_matrix").at(row).at(column);
    view.depth = readNpy<float>(folder_ / "out" / frame.at("depth_file_path"));
    view.ids = readNpy<std::uint32_t>(folder_ / "out" / frame.at("ids_file_path"));
    views.push_back(std::move(view));
  }
  const double fx = file.at("fl_x"), fy = file.at("fl_y"), cx = file.at("cx"), cy = file.at("cy");
  EXPECT_EQ(fx, 40);
  EXPECT_EQ(cy, 25);
  int seen = 0, agreeing = 0;
  for (int y = 0; y < 48; ++y) {
    for (int x = 0; x < 64; ++x) {
      const double z = views[0].depth.at(x, y);
      if (std::isnan(z)) continue;
      const Eigen::Vector4d inFirst((x + 0.5 - cx) / fx * z, -(y + 0.5 - cy) / fy * z, -z, 1);
      const Eigen::Vector4d world = views[0].worldFromCamera * inFirst;
      // The point lies on one of the room's faces.
      const double off = std::min({std::abs(world.y()), std::abs(world.x() - 5),
                                   std::abs(world.y() - 3), std::abs(std::abs(world.z()) - 4)});
      if (views[0].ids.at(x, y) != kColumn) {
        EXPECT_LT(off, 2e-3) << world.transpose();
      }
      const Eigen::Vector4d inSecond = views[1].worldFromCamera.inverse() * world;
      const double u = fx * inSecond.x() / -inSecond.z() + cx;
      const double v = -fy * inSecond.y() / -inSecond.z() + cy;
      if (!(inSecond.z() < 0 && u >= 0 && u < 64 && v >= 0 && v < 48)) continue;
      const int column = static_cast<int>(u), row = static_cast<int>(v);
      if (views[1].ids.at(column, row) != views[0].ids.at(x, y)) continue;  // hidden, or an edge
      ++seen;
      // The pixel's centre is up to half a pixel away, and the floor slopes under it.
      agreeing += std::abs(views[1].depth.at(column, row) + inSecond.z()) < 0.35;
    }
  }
  EXPECT_GT(seen, 1000);
  EXPECT_GT(agreeing, seen * 97 / 100);
}

TEST_F(Capture, ShardsMergeToExactlyTheUnshardedSet) {
  write(folder_ / "path.txt", ahead(5));
  ASSERT_EQ(captured("path.txt", "whole").code, 0);
  ASSERT_EQ(captured("path.txt", "first", {"--shard", "0/2"}).code, 0);
  ASSERT_EQ(captured("path.txt", "second", {"--shard", "1/2"}).code, 0);
  EXPECT_EQ(readTree(folder_ / "first").size(), 3 + 3 * 3U);
  EXPECT_EQ(readTree(folder_ / "second").size(), 3 + 3 * 2U);
  fs::copy(folder_ / "first", folder_ / "merged", fs::copy_options::recursive);
  fs::copy(folder_ / "second", folder_ / "merged",
           fs::copy_options::recursive | fs::copy_options::overwrite_existing);
  EXPECT_EQ(readTree(folder_ / "merged"), readTree(folder_ / "whole"));
}

TEST_F(Capture, OnlyAnEqualRunResumesAStoppedOne) {
  write(folder_ / "path.txt", ahead(4));
  ASSERT_EQ(captured("path.txt", "out").code, 0);
  const auto whole = readTree(folder_ / "out");
  fs::remove(folder_ / "out/rgb/000001.png");
  fs::remove(folder_ / "out/depth/000003.npy");
  const Ended again = captured("path.txt", "out");
  ASSERT_EQ(again.code, 0) << again.err;
  EXPECT_EQ(json::parse(again.out).at("written"), 2);
  EXPECT_EQ(json::parse(again.out).at("already_there"), 2);
  EXPECT_EQ(readTree(folder_ / "out"), whole);
  const Ended other = captured("path.txt", "out", {"--size", "32x24"});
  EXPECT_EQ(other.code, 1);
  EXPECT_NE(other.err.find("contains another capture (lens: "), std::string::npos) << other.err;
  EXPECT_NE(other.err.find("--out"), std::string::npos);
  write(folder_ / "path.txt", ahead(4) + "9 0 1.6 0 0 0 0 1\n");
  EXPECT_EQ(captured("path.txt", "out").code, 1);
  EXPECT_EQ(readTree(folder_ / "out"), whole);
  fs::remove(folder_ / "out/capture.json");
  EXPECT_NE(captured("path.txt", "out").err.find("that identifies them"), std::string::npos);
}

TEST_F(Capture, ALimitedRunContinuesWithoutLimit) {
  write(folder_ / "path.txt", ahead(4));
  ASSERT_EQ(captured("path.txt", "out", {"--limit", "2"}).code, 0);
  const Ended all = captured("path.txt", "out");
  ASSERT_EQ(all.code, 0) << all.err;
  EXPECT_EQ(json::parse(all.out).at("already_there"), 2);
  ASSERT_EQ(captured("path.txt", "fresh").code, 0);
  EXPECT_EQ(readTree(folder_ / "out"), readTree(folder_ / "fresh"));
  const json made = json::parse(readText(folder_ / "out/capture.json"));
  EXPECT_EQ(made.at("names").at("scene"), "room.obj");
  EXPECT_EQ(made.at("names").at("path"), "path.txt");
}

TEST_F(Capture, ARunWithoutFramesReleasesTheFolder) {
  write(folder_ / "path.txt", ahead(1));
  // 16 bits of the finest unit hold 7 cm, and everything visible is farther away.
  const std::vector<std::string> fine{"--channels", "depth",         "--depth",
                                      "png",        "--depth-scale", "1000000"};
  const Ended refused = captured("path.txt", "out", fine);
  EXPECT_EQ(refused.code, 1);
  EXPECT_NE(refused.err.find("--too-far clamp"), std::string::npos) << refused.err;
  std::vector<std::string> clamped = fine;
  clamped.insert(clamped.end(), {"--too-far", "clamp"});
  EXPECT_EQ(captured("path.txt", "out", clamped).code, 0);
  EXPECT_EQ(captured("path.txt", "out", fine).code, 1) << "the folder now holds a frame";
}

TEST_F(Capture, AnEmptyFrameIsReportedAndIsAViolationWithStrict) {
  write(folder_ / "path.json",
        R"([{"eye":[0,1.6,0],"look_at":[5,1,0]},{"eye":[1e6,0,0],"look_at":[2e6,0,0]}])");
  const Ended blind = captured("path.json", "out", {"--every", "3"});
  EXPECT_EQ(blind.code, 0) << blind.err;
  EXPECT_EQ(json::parse(blind.out).at("blind_frames"), json::array({1}));
  EXPECT_NE(blind.err.find("the first is frame 1"), std::string::npos) << blind.err;
  EXPECT_NE(blind.err.find("--every has no effect"), std::string::npos) << blind.err;
  EXPECT_EQ(captured("path.json", "strict", {"--strict"}).code, 3);
}

TEST_F(Capture, AFrameInsideAWallIsReportedByNameAndIsAViolationWithStrict) {
  write(folder_ / "path.txt",
        ahead(1) + "1 5.1 1.6 0 0 -0.7071067811865476 0 0.7071067811865476\n");
  const Ended run = captured("path.txt", "out");
  EXPECT_EQ(run.code, 0) << run.err;
  EXPECT_EQ(json::parse(run.out).at("frames_within_solids"), json::array({1}));
  EXPECT_NE(run.err.find("frame 1: its camera is inside \"room_wall\""), std::string::npos)
      << run.err;
  EXPECT_EQ(captured("path.txt", "strict", {"--strict"}).code, 3);
}

TEST_F(Capture, PicturesAreTheSameForAnyNumberOfThreadsOfGl) {
  write(folder_ / "path.txt", ahead(3));
  std::map<std::string, std::string> first;
  for (const char* threads : {"0", "1", "2"}) {
    ::setenv("LP_NUM_THREADS", threads, 1);  // only for Mesa's llvmpipe; other drivers ignore it
    const std::string out = std::string("out") + threads;
    const Ended ended = captured("path.txt", out,
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
  ASSERT_EQ(captured("path.txt", "whole").code, 0);
  ASSERT_EQ(captured("path.txt", "still", {"--still"}).code, 0);
  const auto ahead = [&](const std::string& out, int frame) {
    const std::string file = out + "/depth/00000" + std::to_string(frame) + ".npy";
    return readNpy<float>(folder_ / file).at(32, 24);
  };
  for (int frame = 0; frame < 3; ++frame) {
    EXPECT_NEAR(ahead("whole", frame), 5 + 0.5 * frame, 0.02) << frame;  // a tick is 1/60 s
    EXPECT_NEAR(ahead("still", frame), 5, 1e-3) << frame;
  }
  for (const char* shard : {"0/2", "1/2"})
    ASSERT_EQ(captured("path.txt", "shards", {"--shard", shard}).code, 0);
  EXPECT_EQ(readTree(folder_ / "shards"), readTree(folder_ / "whole"));
}

TEST_F(Capture, AFailedScriptIsCountedAndIsAViolationWithStrict) {
  write(folder_ / "path.jsonl", R"({"spawn":"ann","at":[0,0,0],"facing":0}
{"walk":"bob","to":[1,0,0]}
{"capture":"ann","as":"here"}
)");
  const Ended run = captured("path.jsonl", "out");
  EXPECT_EQ(run.code, 0) << run.err;
  EXPECT_EQ(json::parse(run.out).at("went_wrong"), 1);
  EXPECT_EQ(captured("path.jsonl", "strict", {"--strict"}).code, 3);
}

TEST_F(Capture, AFullDiskLeavesOnlyCompleteFilesAndIsReported) {
  write(folder_ / "path.txt", ahead(3));
  // A .npy of 64 x 48 floats has 12,416 bytes; the .png of the same image and all else fit.
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const rlimit little{8192, before.rlim_max};
  setrlimit(RLIMIT_FSIZE, &little);
  const pid_t child = start({"capture", path("room.obj"), path("path.txt"), "--out", path("out"),
                             "--size", "64x48", "--no-cache", "--no-mp4"});
  setrlimit(RLIMIT_FSIZE, &before);
  EXPECT_EQ(awaitExitCode(child), 1);
  EXPECT_NE(readText(path("stderr")).find("cannot write " + path("out") + "/depth/00000"),
            std::string::npos)
      << readText(path("stderr"));
  for (const auto& [name, text] : readTree(folder_ / "out")) {
    EXPECT_EQ(name.find(".part"), std::string::npos) << name;
    EXPECT_FALSE(text.empty()) << name;
  }
  EXPECT_FALSE(fs::exists(folder_ / "out/depth/000000.npy"));
  EXPECT_EQ(captured("path.txt", "out").code, 0);
  ASSERT_EQ(captured("path.txt", "fresh").code, 0);
  EXPECT_EQ(readTree(folder_ / "out"), readTree(folder_ / "fresh"));
}

TEST_F(Capture, AnInterruptEndsItWith130AndWholeFiles) {
  write(folder_ / "path.txt", ahead(4000));
  for (const int signal : {SIGINT, SIGTERM}) {
    fs::remove_all(folder_ / "out");
    const pid_t child = start({"capture", path("room.obj"), path("path.txt"), "--out", path("out"),
                               "--size", "64x48", "--progress", "json"});
    for (int i = 0; i < 3000 && !fs::exists(folder_ / "out/ids/000003.npy"); ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    kill(child, signal);
    EXPECT_EQ(awaitExitCode(child), 130);
    const auto tree = readTree(folder_ / "out");
    EXPECT_GT(tree.size(), 3 + 3 * 3U);
    EXPECT_LT(tree.size(), 3 + 3 * 4000U);
    for (const auto& [name, text] : tree) EXPECT_EQ(name.find(".part"), std::string::npos) << name;
    EXPECT_EQ(readText(path("stdout")), "");
    EXPECT_NE(readText(path("stderr")).find("continues from there"), std::string::npos);
    EXPECT_NE(readText(path("stderr")).find("{\"frames\":"), std::string::npos);
  }
}

TEST_F(Capture, AWalkIsSeenThroughItsAvatarsEyes) {
  write(folder_ / "walk.jsonl",
        R"({"spawn":"ann","at":[0,0,0],"facing":0}
{"spawn":"bob","at":[3,0,0],"facing":180}
{"capture":"ann","as":"first"}
{"walk":"ann","to":[1,0,0],"speed":1}
{"capture":"ann","as":"second"}
{"capture":"bob","as":"bobs"}
)");
  const Ended ended = captured("walk.jsonl", "out");
  ASSERT_EQ(ended.code, 0) << ended.err;
  EXPECT_EQ(json::parse(ended.out).at("frames"), 3);
  const auto instances = json::parse(readText(folder_ / "out/instances.json"));
  std::uint32_t ann = 0, bob = 0;
  for (const auto& [id, one] : instances.items()) {
    if (one.at("path") == "ann") ann = static_cast<std::uint32_t>(std::stoul(id));
    if (one.at("path") == "bob") bob = static_cast<std::uint32_t>(std::stoul(id));
  }
  const auto frames = json::parse(readText(folder_ / "out/transforms.json")).at("frames");
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const auto ids = readNpy<std::uint32_t>(folder_ / "out" / frames[i].at("ids_file_path"));
    const bool annSees = frames[i].at("name") != "bobs";
    const auto seen = [&](std::uint32_t id) {
      return std::count(ids.values.begin(), ids.values.end(), id);
    };
    EXPECT_GT(seen(annSees ? bob : ann), 0) << i;
    EXPECT_EQ(seen(annSees ? ann : bob), 0) << i;
  }
  const Ended every =
      captured("walk.jsonl", "every",
               {"--every", "6", "--avatar", "ann", "--channels", "rgb", "--shard", "1/4"});
  ASSERT_EQ(every.code, 0) << every.err;
  EXPECT_GT(json::parse(every.out).at("frames"), 9);
  EXPECT_EQ(captured("walk.jsonl", "unknown", {"--every", "6", "--avatar", "eve"}).code, 1);
}

TEST(LabelName, SaysWhatAPersonWouldSay) {
  const std::pair<const char*, const char*> names[] = {
      {"site/IfcSlab_sporenkap_3rT2B46bX7bfYW98$CQ_BF_0_node_1", "IfcSlab_sporenkap"},
      {"IfcWall_binnenblad_06P8M5eRX7Q8DMqxH3c_wl", "IfcWall_binnenblad"},
      {"IfcMappedItem_node_389", "IfcMappedItem"},
      {"Level 2/Basic Wall:Exterior - Brick on Block:143478",
       "Basic Wall:Exterior - Brick on Block"},
      {"M_Single-Flush:0762 x 2032mm:0762 x 2032mm:150173", "M_Single-Flush:0762 x 2032mm"},
      {"Stair:Residential:151086/Stair:Residential:151086:1#2", "Stair:Residential"},
      {"scene/aws_Bed_01_visual/aws_Bed_01_visual_node/aws_Bed_01_visual_0", "aws_Bed_01"},
      {"hall/north_wall/piece03", "north_wall"},
      {"hall/picture02/frame/canvas", "picture02"},
      {"hall/window01/frame_left", "window01"},
      {"hall/framework", "framework"},
      {"frame", "frame"},
      {"room/Chair#4", "Chair"},
      {"hall/_node_3", "hall"},
      {"door_3_of_the_western_wing_1", "door_3_of_the_western_wing_1"},
      {"stair_3_of_the_western_wings", "stair_3_of_the_western_wings"},
      {"", ""}};
  for (const auto& [path, label] : names) EXPECT_EQ(makeLabelName(path), label) << path;
}

TEST_F(Capture, AvatarsAreDrawnAsPeopleOrAsTheirShapes) {
  write(folder_ / "walk.jsonl", R"({"spawn":"ann","at":[0,0.001,0],"facing":0}
{"spawn":"bob","at":[2,0.001,0],"facing":180}
{"capture":"ann","as":"bob"}
)");
  const auto pixels = [&](const std::string& avatars) {
    const Ended ended = captured("walk.jsonl", avatars, {"--avatars", avatars});
    EXPECT_EQ(ended.code, 0) << ended.err;
    EXPECT_EQ(json::parse(readText(folder_ / avatars / "capture.json")).at("avatars"), avatars);
    const auto ids = readNpy<std::uint32_t>(folder_ / avatars / "ids/000000.npy").values;
    return std::count_if(ids.begin(), ids.end(), [](std::uint32_t id) { return id > 3; });
  };
  const auto people = pixels("people"), shapes = pixels("shapes");
  EXPECT_GT(people, 50);
  EXPECT_GT(2 * shapes, 3 * people);
  const Ended other = captured("walk.jsonl", "other", {"--avatars", "ghosts"});
  EXPECT_EQ(other.code, 2);
  EXPECT_NE(other.err.find("--avatars"), std::string::npos) << other.err;
  EXPECT_NE(other.err.find("shapes"), std::string::npos) << other.err;
}

TEST_F(Capture, SamplesAndShadowsChangeOnlyTheColour) {
  write(folder_ / "path.txt", ahead(1));
  const auto manifest = [&](const std::string& out, std::vector<std::string> options) {
    const Ended ended = captured("path.txt", out, std::move(options));
    EXPECT_EQ(ended.code, 0) << ended.err;
    return json::parse(readText(folder_ / out / "capture.json"));
  };
  const json plain = manifest("plain", {}), smooth = manifest("smooth", {"--samples", "4"}),
             sunless = manifest("sunless", {"--no-shadows"});
  EXPECT_EQ(plain.at("samples"), 1);
  EXPECT_EQ(smooth.at("samples"), 4);
  EXPECT_EQ(plain.at("shadows"), true);
  EXPECT_EQ(sunless.at("shadows"), false);
  for (const char* other : {"smooth", "sunless"}) {
    EXPECT_NE(readText(folder_ / other / "rgb/000000.png"),
              readText(folder_ / "plain/rgb/000000.png"));
    for (const char* file : {"ids/000000.npy", "depth/000000.npy"})
      EXPECT_EQ(readText(folder_ / other / file), readText(folder_ / "plain" / file)) << other;
  }
  const Ended refused = captured("path.txt", "refused", {"--samples", "3"});
  EXPECT_EQ(refused.code, 2);
  EXPECT_NE(refused.err.find("--samples"), std::string::npos) << refused.err;
  for (const char* allowed : {"1", "4", "16"})
    EXPECT_NE(refused.err.find(allowed), std::string::npos) << refused.err;
}

TEST_F(Capture, SixteenBitFilesRefuseValuesOutOfRangeByDefault) {
  write(folder_ / "path.txt", ahead(1));
  const Ended fits = captured("path.txt", "fits", {"--depth", "png", "--ids", "png"});
  ASSERT_EQ(fits.code, 0) << fits.err;
  EXPECT_TRUE(fs::exists(folder_ / "fits/depth/000000.png"));
  EXPECT_TRUE(fs::exists(folder_ / "fits/ids/000000.png"));
  const Ended refused =
      captured("path.txt", "refused", {"--depth", "png", "--depth-scale", "14000"});
  EXPECT_EQ(refused.code, 1);
  EXPECT_NE(refused.err.find("depth/000000.png: "), std::string::npos) << refused.err;
  EXPECT_NE(refused.err.find("--too-far clamp"), std::string::npos) << refused.err;
  EXPECT_FALSE(fs::exists(folder_ / "refused/depth/000000.png"));
  const Ended clamped = captured(
      "path.txt", "clamped", {"--depth", "zst", "--depth-scale", "14000", "--too-far", "clamp"});
  ASSERT_EQ(clamped.code, 0) << clamped.err;
  EXPECT_GT(json::parse(clamped.out).at("clamped_pixels"), 0);
}

TEST_F(Capture, TheTumLayoutIsReadBackAsTheSamePath) {
  write(folder_ / "path.txt", ahead(3));
  const Ended first = captured("path.txt", "tum", {"--layout", "tum", "--channels", "rgb,depth"});
  ASSERT_EQ(first.code, 0) << first.err;
  EXPECT_NE(readText(folder_ / "tum/rgb.txt").find("0.033333 rgb/000001.png"), std::string::npos);
  EXPECT_NE(readText(folder_ / "tum/depth.txt").find("0.066667 depth/000002.png"),
            std::string::npos);
  const Ended again = captured(
      "tum/groundtruth.txt", "again",
      {"--axes", "opencv", "--channels", "rgb,depth", "--depth", "png", "--depth-scale", "5000"});
  ASSERT_EQ(again.code, 0) << again.err;
  for (const char* file : {"rgb/000000.png", "rgb/000002.png", "depth/000001.png"})
    EXPECT_EQ(readText(folder_ / "again" / file), readText(folder_ / "tum" / file)) << file;
  const Ended own = captured("tum/transforms.json", "own", {"--channels", "rgb"});
  ASSERT_EQ(own.code, 0) << own.err;
  EXPECT_EQ(readText(folder_ / "own/rgb/000001.png"), readText(folder_ / "tum/rgb/000001.png"));
}

TEST_F(Capture, EveryChannelIsWrittenOnRequest) {
  write(folder_ / "path.txt", ahead(1));
  const Ended ended =
      captured("path.txt", "out", {"--channels", "normals,range,depth,rgb", "--rgb", "jpeg"});
  ASSERT_EQ(ended.code, 0) << ended.err;
  EXPECT_TRUE(fs::exists(folder_ / "out/rgb/000000.jpg"));
  const auto depth = readNpy<float>(folder_ / "out/depth/000000.npy");
  const auto range = readNpy<float>(folder_ / "out/range/000000.npy");
  const auto normals = readNpy<float>(folder_ / "out/normals/000000.npy");
  EXPECT_NEAR(range.at(32, 24), depth.at(32, 24), 1e-2);
  EXPECT_GT(range.at(32, 40), depth.at(32, 40) + 0.1f);
  const std::size_t middle = 3 * (24 * 64 + 32);
  EXPECT_NEAR(normals.values.at(middle), -1, 1e-5);  // the wall faces the eye
}

TEST_F(Capture, RaysDrawTheSameSceneAndTheManifestNamesThem) {
  write(folder_ / "path.txt", ahead(1));
  const Ended gl = captured("path.txt", "gl", {"--renderer", "gl"});
  const Ended rays = captured("path.txt", "rays", {"--renderer", "rays"});
  ASSERT_EQ(gl.code, 0) << gl.err;
  ASSERT_EQ(rays.code, 0) << rays.err;
  EXPECT_NE(json::parse(rays.out).at("renderer"), json::parse(gl.out).at("renderer"));
  EXPECT_EQ(json::parse(readText(folder_ / "rays/capture.json")).at("renderer"),
            json::parse(rays.out).at("renderer"));
  const auto drawn = readNpy<std::uint32_t>(folder_ / "gl/ids/000000.npy");
  const auto cast = readNpy<std::uint32_t>(folder_ / "rays/ids/000000.npy");
  int other = 0;
  for (std::size_t i = 0; i < drawn.values.size(); ++i) other += drawn.values[i] != cast.values[i];
  EXPECT_LT(other, 64);  // along edges
  const Ended mixed = captured("path.txt", "gl", {"--renderer", "rays"});
  EXPECT_EQ(mixed.code, 1);
  EXPECT_NE(mixed.err.find("renderer: "), std::string::npos) << mixed.err;
}

TEST_F(Capture, AnOverlayMarksACopyAndLeavesTheColourAlone) {
  write(folder_ / "walk.jsonl",
        R"({"spawn":"ann","at":[0,0,0],"facing":0}
{"spawn":"bob","at":[3,0,1],"facing":90}
{"walk":"bob","to":[3,0,-0.5],"speed":1}
{"wait":2,"for":"ann"}
{"capture":"ann","as":"one"}
)");
  ASSERT_EQ(captured("walk.jsonl", "plain", {"--size", "160x120"}).code, 0);
  const Ended ended = captured("walk.jsonl", "marked",
                               {"--size", "160x120", "--overlay", "boxes,paths,contacts,names"});
  ASSERT_EQ(ended.code, 0) << ended.err;
  const auto readImage = [&](const char* file) {
    const std::string png = readText(folder_ / file);
    return render::decodePng({png.begin(), png.end()});
  };
  const render::Image plain = readImage("plain/rgb/000000.png");
  EXPECT_EQ(readImage("marked/rgb/000000.png").rgb, plain.rgb);
  const render::Image marked = readImage("marked/overlay/000000.png");
  const auto ids = readNpy<std::uint32_t>(folder_ / "marked/ids/000000.npy");
  const auto changed = [&](int x, int y) {
    const auto i = 3 * static_cast<std::ptrdiff_t>(y * 160 + x);
    return !std::equal(marked.rgb.begin() + i, marked.rgb.begin() + i + 3, plain.rgb.begin() + i);
  };
  // The border of Bob's rectangle is marked, and so is the floor on his path.
  int top = 120, left = 160, floorMarked = 0;
  for (int y = 0; y < 120; ++y) {
    for (int x = 0; x < 160; ++x) {
      if (ids.at(x, y) > kColumn) {
        top = std::min(top, y);
        left = std::min(left, x);
      }
      floorMarked += ids.at(x, y) == kFloor && changed(x, y);
    }
  }
  ASSERT_LT(top, 120);
  EXPECT_TRUE(changed(left, top));
  EXPECT_GT(floorMarked, 20);
  EXPECT_EQ(captured("walk.jsonl", "wrong", {"--overlay", "boxen"}).code, 2);
}

TEST(Overlay, LabelsOfConcentricObjectsAreSeparateAndInsideTheImage) {
  // A ring around a square, both in the picture's lower right corner.
  render::Frame frame;
  frame.camera.width = frame.camera.height = 100;
  frame.rgb.assign(3 * 100 * 100, 200);
  frame.ids.assign(100 * 100, 0);
  for (int y = 70; y < 100; ++y) {
    for (int x = 70; x < 100; ++x)
      frame.ids[static_cast<std::size_t>(100 * y + x)] =
          std::max(std::abs(x - 85), std::abs(y - 85)) < 8 ? 2 : 1;
  }
  const auto inked = [&](const char* outer, const char* inner) {
    scene::Model model;
    model.objects.resize(2);
    model.objects[0].path = outer;
    model.objects[1].path = inner;
    OverlayChoice names;
    names.names = true;
    const render::Image image =
        drawOverlay(frame, names, model, scene::computeObjectClasses(model), {}, {});
    std::size_t count = 0;
    for (std::size_t i = 0; i < image.rgb.size(); i += 3) count += image.rgb[i] < 100;
    return count;
  };
  const std::size_t outer = inked("a/ring", "b/"), inner = inked("a/", "b/square");
  EXPECT_GT(outer, 20U);
  EXPECT_GT(inner, 20U);
  EXPECT_EQ(inked("a/ring", "b/square"), outer + inner);
}

TEST_F(Capture, DepthReportsAreNextToTheFramesAndAddedIfMissing) {
  write(folder_ / "path.txt", ahead(3));
  const std::vector<std::string> options{"--size", "64x48", "--channels", "rgb"};
  ASSERT_EQ(captured("path.txt", "out", options).code, 0);
  const auto before = readTree(folder_ / "out");
  std::vector<std::string> reporting = options;
  reporting.push_back("--report-depth");
  ASSERT_EQ(captured("path.txt", "out", reporting).code, 0);
  const auto after = readTree(folder_ / "out");
  EXPECT_EQ(after.size(), before.size() + 4);
  for (const auto& [name, text] : before) EXPECT_EQ(after.at(name), text) << name;
  const json whole = json::parse(after.at("depth_report.json"));
  EXPECT_EQ(whole["frames"], 3);
  EXPECT_EQ(whole["pixels"], 3 * 64 * 48);
  EXPECT_GT(whole["depth"]["away_from_edges"]["pixels"], 64 * 48);
  EXPECT_LT(whole["depth"]["away_from_edges"]["max_mm"], 3);
  EXPECT_EQ(json::parse(after.at("depth_report/000002.json"))["frames"], 1);
}

TEST_F(Capture, FfmpegMakesTheFilmWhenAllFramesAreThere) {
  fs::create_directories(folder_ / "bin");
  write(folder_ / "bin/ffmpeg", "#!/bin/sh\nfor last; do :; done\necho \"$@\" > \"$last\"\n");
  fs::permissions(folder_ / "bin/ffmpeg", fs::perms::owner_all);
  const std::string before = getenv("PATH") ? getenv("PATH") : "";
  setenv("PATH", (path("bin") + ":" + before).c_str(), 1);
  write(folder_ / "path.txt", ahead(4));
  film_ = true;
  const Ended half = captured("path.txt", "out", {"--shard", "0/2", "--channels", "rgb"});
  EXPECT_TRUE(json::parse(half.out).at("video").is_null());
  const Ended all = captured("path.txt", "out", {"--channels", "rgb"});
  setenv("PATH", before.c_str(), 1);
  EXPECT_EQ(json::parse(all.out).at("video"), "video.mp4") << all.err;
  EXPECT_NE(readText(folder_ / "out/video.mp4").find("-framerate 30 "), std::string::npos)
      << readText(folder_ / "out/video.mp4");
}

TEST_F(Capture, ADryRunReportsAndWritesNothing) {
  write(folder_ / "path.txt", ahead(5));
  const Ended ended = captured("path.txt", "out", {"--dry-run", "--shard", "1/2", "--limit", "4"});
  ASSERT_EQ(ended.code, 0) << ended.err;
  EXPECT_EQ(json::parse(ended.out).at("frames"), 4);
  EXPECT_EQ(json::parse(ended.out).at("shard_frames"), 2);
  EXPECT_FALSE(fs::exists(folder_ / "out"));
}

TEST_F(Capture, ErrorsAreReportedBeforeAnyOutput) {
  write(folder_ / "path.txt", ahead(1));
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
    const Ended ended = captured("path.txt", "out", wrong);
    EXPECT_EQ(ended.code, 2) << wrong[0] << " " << wrong[1] << ended.err;
  }
  write(folder_ / "nan.txt", "0 nan 0 0 0 0 0 1\n");
  const Ended ended = captured("nan.txt", "out");
  EXPECT_EQ(ended.code, 1);
  EXPECT_NE(ended.err.find("nan.txt:1: 'nan'"), std::string::npos) << ended.err;
  EXPECT_EQ(captured("missing.txt", "out").code, 1);
  EXPECT_EQ(captured("path.txt", "out", {"--near", "5", "--far", "4"}).code, 1);
  EXPECT_TRUE(readTree(folder_ / "out").empty());
}

}  // namespace
}  // namespace enfilade::server::testing
