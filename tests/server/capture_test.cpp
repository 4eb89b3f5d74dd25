// Tests of the program `enfilade capture` in the small room: what its files show.
#include <cmath>

#include "render/image/image.hpp"
#include "server/capture/metadata_files.hpp"
#include "server/capture/overlay.hpp"
#include "server/floors/label_names.hpp"
#include "tests/server/body_room.hpp"
#include "tests/server/capture_fixture.hpp"

namespace enfilade::server::testing {
namespace {

TEST_F(Capture, FilesFollowTheLayoutAndHoldTheImages) {
  write(folder_ / "path.txt", makePathAhead(2));
  const Ended ended = runCapture("path.txt", "out", {"--fov", "90"});
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
  scene::Model model = makeBodyRoomModel();
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
  ASSERT_EQ(runCapture("path.json", "out", {"--intrinsics", "40,50,30,25"}).code, 0);
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

TEST_F(Capture, AnEmptyFrameIsReportedAndIsAViolationWithStrict) {
  write(folder_ / "path.json",
        R"([{"eye":[0,1.6,0],"look_at":[5,1,0]},{"eye":[1e6,0,0],"look_at":[2e6,0,0]}])");
  const Ended blind = runCapture("path.json", "out", {"--every", "3"});
  EXPECT_EQ(blind.code, 0) << blind.err;
  EXPECT_EQ(json::parse(blind.out).at("blind_frames"), json::array({1}));
  EXPECT_NE(blind.err.find("the first is frame 1"), std::string::npos) << blind.err;
  EXPECT_NE(blind.err.find("--every has no effect"), std::string::npos) << blind.err;
  EXPECT_EQ(runCapture("path.json", "strict", {"--strict"}).code, 3);
}

TEST_F(Capture, AFrameInsideAWallIsReportedByNameAndIsAViolationWithStrict) {
  write(folder_ / "path.txt",
        makePathAhead(1) + "1 5.1 1.6 0 0 -0.7071067811865476 0 0.7071067811865476\n");
  const Ended run = runCapture("path.txt", "out");
  EXPECT_EQ(run.code, 0) << run.err;
  EXPECT_EQ(json::parse(run.out).at("frames_within_solids"), json::array({1}));
  EXPECT_NE(run.err.find("frame 1: its camera is inside \"room_wall\""), std::string::npos)
      << run.err;
  EXPECT_EQ(runCapture("path.txt", "strict", {"--strict"}).code, 3);
}

TEST_F(Capture, AFailedScriptIsCountedAndIsAViolationWithStrict) {
  write(folder_ / "path.jsonl", R"({"spawn":"ann","at":[0,0,0],"facing":0}
{"walk":"bob","to":[1,0,0]}
{"capture":"ann","as":"here"}
)");
  const Ended run = runCapture("path.jsonl", "out");
  EXPECT_EQ(run.code, 0) << run.err;
  EXPECT_EQ(json::parse(run.out).at("went_wrong"), 1);
  EXPECT_EQ(runCapture("path.jsonl", "strict", {"--strict"}).code, 3);
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
  const Ended ended = runCapture("walk.jsonl", "out");
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
      runCapture("walk.jsonl", "every",
                 {"--every", "6", "--avatar", "ann", "--channels", "rgb", "--shard", "1/4"});
  ASSERT_EQ(every.code, 0) << every.err;
  EXPECT_GT(json::parse(every.out).at("frames"), 9);
  EXPECT_EQ(runCapture("walk.jsonl", "unknown", {"--every", "6", "--avatar", "eve"}).code, 1);
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
    const Ended ended = runCapture("walk.jsonl", avatars, {"--avatars", avatars});
    EXPECT_EQ(ended.code, 0) << ended.err;
    EXPECT_EQ(json::parse(readText(folder_ / avatars / "capture.json")).at("avatars"), avatars);
    const auto ids = readNpy<std::uint32_t>(folder_ / avatars / "ids/000000.npy").values;
    return std::count_if(ids.begin(), ids.end(), [](std::uint32_t id) { return id > 3; });
  };
  const auto people = pixels("people"), shapes = pixels("shapes");
  EXPECT_GT(people, 50);
  EXPECT_GT(2 * shapes, 3 * people);
  const Ended other = runCapture("walk.jsonl", "other", {"--avatars", "ghosts"});
  EXPECT_EQ(other.code, 2);
  EXPECT_NE(other.err.find("--avatars"), std::string::npos) << other.err;
  EXPECT_NE(other.err.find("shapes"), std::string::npos) << other.err;
}

TEST_F(Capture, SamplesAndShadowsChangeOnlyTheColour) {
  write(folder_ / "path.txt", makePathAhead(1));
  const auto manifest = [&](const std::string& out, std::vector<std::string> options) {
    const Ended ended = runCapture("path.txt", out, std::move(options));
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
  const Ended refused = runCapture("path.txt", "refused", {"--samples", "3"});
  EXPECT_EQ(refused.code, 2);
  EXPECT_NE(refused.err.find("--samples"), std::string::npos) << refused.err;
  for (const char* allowed : {"1", "4", "16"})
    EXPECT_NE(refused.err.find(allowed), std::string::npos) << refused.err;
}

TEST_F(Capture, SixteenBitFilesRefuseValuesOutOfRangeByDefault) {
  write(folder_ / "path.txt", makePathAhead(1));
  const Ended fits = runCapture("path.txt", "fits", {"--depth", "png", "--ids", "png"});
  ASSERT_EQ(fits.code, 0) << fits.err;
  EXPECT_TRUE(fs::exists(folder_ / "fits/depth/000000.png"));
  EXPECT_TRUE(fs::exists(folder_ / "fits/ids/000000.png"));
  const Ended refused =
      runCapture("path.txt", "refused", {"--depth", "png", "--depth-scale", "14000"});
  EXPECT_EQ(refused.code, 1);
  EXPECT_NE(refused.err.find("depth/000000.png: "), std::string::npos) << refused.err;
  EXPECT_NE(refused.err.find("--too-far clamp"), std::string::npos) << refused.err;
  EXPECT_FALSE(fs::exists(folder_ / "refused/depth/000000.png"));
  const Ended clamped = runCapture(
      "path.txt", "clamped", {"--depth", "zst", "--depth-scale", "14000", "--too-far", "clamp"});
  ASSERT_EQ(clamped.code, 0) << clamped.err;
  EXPECT_GT(json::parse(clamped.out).at("clamped_pixels"), 0);
}

TEST_F(Capture, TheTumLayoutIsReadBackAsTheSamePath) {
  write(folder_ / "path.txt", makePathAhead(3));
  const Ended first = runCapture("path.txt", "tum", {"--layout", "tum", "--channels", "rgb,depth"});
  ASSERT_EQ(first.code, 0) << first.err;
  EXPECT_NE(readText(folder_ / "tum/rgb.txt").find("0.033333 rgb/000001.png"), std::string::npos);
  EXPECT_NE(readText(folder_ / "tum/depth.txt").find("0.066667 depth/000002.png"),
            std::string::npos);
  const Ended again = runCapture(
      "tum/groundtruth.txt", "again",
      {"--axes", "opencv", "--channels", "rgb,depth", "--depth", "png", "--depth-scale", "5000"});
  ASSERT_EQ(again.code, 0) << again.err;
  for (const char* file : {"rgb/000000.png", "rgb/000002.png", "depth/000001.png"})
    EXPECT_EQ(readText(folder_ / "again" / file), readText(folder_ / "tum" / file)) << file;
  const Ended own = runCapture("tum/transforms.json", "own", {"--channels", "rgb"});
  ASSERT_EQ(own.code, 0) << own.err;
  EXPECT_EQ(readText(folder_ / "own/rgb/000001.png"), readText(folder_ / "tum/rgb/000001.png"));
}

TEST_F(Capture, EveryChannelIsWrittenOnRequest) {
  write(folder_ / "path.txt", makePathAhead(1));
  const Ended ended =
      runCapture("path.txt", "out", {"--channels", "normals,range,depth,rgb", "--rgb", "jpeg"});
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
  write(folder_ / "path.txt", makePathAhead(1));
  const Ended gl = runCapture("path.txt", "gl", {"--renderer", "gl"});
  const Ended rays = runCapture("path.txt", "rays", {"--renderer", "rays"});
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
  const Ended mixed = runCapture("path.txt", "gl", {"--renderer", "rays"});
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
  ASSERT_EQ(runCapture("walk.jsonl", "plain", {"--size", "160x120"}).code, 0);
  const Ended ended = runCapture("walk.jsonl", "marked",
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
  EXPECT_EQ(runCapture("walk.jsonl", "wrong", {"--overlay", "boxen"}).code, 2);
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
  write(folder_ / "path.txt", makePathAhead(3));
  const std::vector<std::string> options{"--size", "64x48", "--channels", "rgb"};
  ASSERT_EQ(runCapture("path.txt", "out", options).code, 0);
  const auto before = readTree(folder_ / "out");
  std::vector<std::string> reporting = options;
  reporting.push_back("--report-depth");
  ASSERT_EQ(runCapture("path.txt", "out", reporting).code, 0);
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

}  // namespace
}  // namespace enfilade::server::testing
