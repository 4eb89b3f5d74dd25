// Tests of `enfilade inspect`: its report, and its exit codes after wrong use.
#include <algorithm>
#include <regex>

#include "server/base/version.hpp"
#include "tests/scene/hand_made_ifc.hpp"
#include "tests/server/program_fixture.hpp"

namespace enfilade::server::testing {
namespace {

namespace fs = std::filesystem;
class Inspect : public ProgramFixture {};

TEST_F(Inspect, DescribesTheSceneAsJson) {
  const Ended ended = run({"inspect", getPath("room.obj"), "--json", "--unit", "m", "--objects"});
  ASSERT_EQ(ended.code, 0) << ended.err;
  const auto all = nlohmann::json::parse(ended.out);
  EXPECT_EQ(all.at("objects"), 3);
  EXPECT_EQ(all.at("meshes"), 3);
  EXPECT_EQ(all.at("triangles"), all.at("unique_triangles"));
  EXPECT_EQ(all.at("convex_parts"), 3);
  EXPECT_EQ(all.at("unit"), 1);
  EXPECT_EQ(all.at("up"), "y");
  EXPECT_EQ(all.at("offset"), nlohmann::json({0.0, 0.0, 0.0}));
  EXPECT_EQ(all.at("bounds").at("size").at(0), 20);
  EXPECT_TRUE(all.at("bodies").is_array());
  EXPECT_TRUE(all.at("problems").empty()) << ended.out;
  EXPECT_GT(all.at("import_seconds"), 0);
  EXPECT_GT(all.at("peak_mb"), 1);
  ASSERT_EQ(all.at("object_list").size(), 3u);
  EXPECT_EQ(all.at("object_list").at(1).at("path"), "room_wall");
  EXPECT_EQ(all.at("object_list").at(1).at("box").at("min").at(0), 5);
}

TEST_F(Inspect, DescribesTheOperationOfADoor) {
  write(folder_ / "house.ifc", tests::IfcHouse().makeText());
  const Ended ended = run({"inspect", getPath("house.ifc"), "--json", "--objects"});
  ASSERT_EQ(ended.code, 0) << ended.err;
  const auto all = nlohmann::json::parse(ended.out);
  int doors = 0;
  for (const auto& object : all.at("object_list")) {
    const bool isDoor = object.value("class", "") == "IfcDoor";
    doors += isDoor ? 1 : 0;
    EXPECT_EQ(object.value("operation", "none"), isDoor ? "SINGLE_SWING_LEFT" : "none") << object;
  }
  EXPECT_GE(doors, 1);
}

TEST_F(Inspect, ListsStoreysOfIfcWithTheirObjects) {
  write(folder_ / "house.ifc", tests::IfcHouse().makeText());
  const Ended ended = run({"inspect", getPath("house.ifc"), "--json", "--objects"});
  ASSERT_EQ(ended.code, 0) << ended.err;
  const auto all = nlohmann::json::parse(ended.out);
  ASSERT_EQ(all.at("storeys").size(), 1u);
  const auto& storey = all.at("storeys").at(0);
  EXPECT_EQ(storey.at("name"), "Ground/floor");
  EXPECT_EQ(storey.at("elevation"), 0);
  EXPECT_EQ(storey.at("objects"), 2);
  EXPECT_EQ(storey.at("classes"), nlohmann::json({{"IfcDoor", 1}, {"IfcWall", 1}}));
  EXPECT_EQ(all.at("classes"), storey.at("classes"));
  EXPECT_EQ(all.at("object_list").at(0).at("storey"), "Ground/floor");
  const Ended table = run({"inspect", getPath("house.ifc")});
  EXPECT_NE(table.out.find("0.000 m       2  Ground/floor"), std::string::npos) << table.out;
}

TEST_F(Inspect, ReportsNorthAsTheIfcFileStatesItAndElseItsYAxis) {
  const Ended room = run({"inspect", getPath("room.obj"), "--json", "--unit", "m"});
  EXPECT_TRUE(nlohmann::json::parse(room.out).at("north").is_null()) << "OBJ has no north";
  std::string text = tests::IfcHouse().makeText();
  write(folder_ / "house.ifc", text);
  const auto report = [&] {
    const Ended ended = run({"inspect", getPath("house.ifc"), "--json"});
    EXPECT_EQ(ended.code, 0) << ended.err;
    return nlohmann::json::parse(ended.out).at("north");
  };
  EXPECT_NEAR(report().at("x"), 0, 1e-12);
  EXPECT_NEAR(report().at("facing"), 90, 1e-9);
  const std::string context = "1.E-05,#11,$)";
  text.replace(text.find(context), context.size(), "1.E-05,#11,#16)");
  text.insert(text.find("#20="), "#16=IFCDIRECTION((1.,0.));\n");
  write(folder_ / "house.ifc", text);
  EXPECT_NEAR(report().at("x"), 1, 1e-12);
  EXPECT_NEAR(report().at("facing"), 0, 1e-9);
}

TEST_F(Inspect, DescribesThePathOfABody) {
  write(folder_ / "room.walk.json",
        R"({"walk":1,"bodies":[{"name":"sign","kind":"path","objects":["room_wall"],
            "keys":[{"time":0},{"time":2,"offset":[0,1,0],"turn":180}]}]})");
  const Ended ended = run({"inspect", getPath("room.obj"), "--json", "--unit", "m"});
  ASSERT_EQ(ended.code, 0) << ended.err;
  const auto body = nlohmann::json::parse(ended.out).at("bodies").at(0);
  EXPECT_EQ(body.at("seconds"), 2);
  EXPECT_EQ(body.at("loops"), false);
  EXPECT_EQ(body.at("keys").at(1).at("offset"), nlohmann::json({0, 1, 0}));
  EXPECT_NEAR(body.at("keys").at(1).at("turn"), 3.14159265358979, 1e-12) << "radians";
}

TEST_F(Inspect, StrictFailsOnWarningsThatAreNotAccepted) {
  const auto strictly = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"inspect", getPath("room.obj"), "--strict", "--unit", "m"});
    return run(more);
  };
  EXPECT_EQ(strictly({}).code, 0);
  write(folder_ / "room.obj", makeSmallRoomObj() + "o again\nf 1 2 3\nf 1 2 3\n");
  const Ended notes = strictly({});
  EXPECT_EQ(notes.code, 0) << "notes never fail";
  EXPECT_NE(notes.out.find("note           1  duplicate_triangle"), std::string::npos) << notes.out;

  write(folder_ / "room.obj", "mtllib absent.mtl\n" + makeSmallRoomObj());
  EXPECT_EQ(run({"inspect", getPath("room.obj"), "--unit", "m"}).code, 0);
  const Ended failed = strictly({});
  EXPECT_EQ(failed.code, 3);
  EXPECT_NE(failed.err.find("--accept missing_material_file"), std::string::npos) << failed.err;
  EXPECT_LT(std::count(failed.out.begin(), failed.out.end(), '\n'), 40);
  EXPECT_EQ(strictly({"--accept", "no_unit"}).code, 3);
  EXPECT_EQ(strictly({"--accept", "warnings"}).code, 0);
  const Ended accepted = strictly({"--accept", "no_unit,missing_material_file", "--json"});
  EXPECT_EQ(accepted.code, 0) << accepted.err;
  const auto problem = nlohmann::json::parse(accepted.out).at("problems").at(0);
  EXPECT_EQ(problem.at("kind"), "missing_material_file");
  EXPECT_EQ(problem.at("severity"), "warning");
  EXPECT_EQ(problem.at("accepted"), true);
}

TEST_F(Inspect, StrictFailsOnTheProblemsThatAreNotAcceptedAlone) {
  // No unit, no material file, and the same object twice; a degenerate triangle is but a note.
  write(folder_ / "room.obj",
        "mtllib absent.mtl\n" + makeSmallRoomObj() +
            "o first\nf 1 2 3\no second\nf 1 2 3\no thin\nf 1 2 4\nf 1 1 2\n");
  const auto failing = [&](const std::string& accepted) {
    std::vector<std::string> arguments{"inspect", getPath("room.obj"), "--strict", "--json"};
    if (!accepted.empty()) arguments.insert(arguments.end(), {"--accept", accepted});
    const Ended ended = run(arguments);
    std::vector<std::string> kinds;
    std::smatch list;
    if (std::regex_search(ended.err, list, std::regex("--accept ([a-z_,]+) accepts them")))
      kinds.push_back(list[1]);
    EXPECT_EQ(ended.code, kinds.empty() ? 0 : 3) << ended.err;
    const auto report = nlohmann::json::parse(ended.out);
    for (const auto& problem : report.at("problems"))
      if (problem.at("accepted") == true) kinds.push_back(problem.at("kind"));
    return kinds;
  };
  using Kinds = std::vector<std::string>;
  EXPECT_EQ(failing(""), Kinds({"no_unit,missing_material_file,repeated_object"}));
  EXPECT_EQ(failing("no_unit"), Kinds({"missing_material_file,repeated_object", "no_unit"}));
  EXPECT_EQ(failing("repeated_object,missing_material_file"),
            Kinds({"no_unit", "missing_material_file", "repeated_object"}));
  EXPECT_EQ(failing("no_unit,repeated_object,missing_material_file"),
            Kinds({"no_unit", "missing_material_file", "repeated_object"}));
}

TEST_F(Inspect, WritesAPageWithPlansAndEscapesTheFilesText) {
  write(folder_ / "room.obj", "mtllib <b>absent.mtl\n" + makeSmallRoomObj());
  const Ended ended =
      run({"inspect", getPath("room.obj"), "--unit", "m", "--html", getPath("report.html")});
  ASSERT_EQ(ended.code, 0) << ended.err;
  const std::string page = readText(getPath("report.html"));
  EXPECT_NE(page.find("<h1>room.obj</h1>"), std::string::npos);
  EXPECT_NE(page.find("missing_material_file"), std::string::npos);
  EXPECT_NE(page.find("&lt;b&gt;absent.mtl"), std::string::npos);
  EXPECT_EQ(page.find("<b>"), std::string::npos);
  EXPECT_NE(page.find("src=\"data:image/png;base64,iVBORw0KGgo"), std::string::npos);
  EXPECT_EQ(page.find("<script"), std::string::npos);
}

TEST_F(Inspect, DrawsAPlanOfEachStorey) {
  const Ended drawn = run({"inspect", getPath("room.obj"), "--plan", getPath("plans")});
  ASSERT_EQ(drawn.code, 0) << drawn.err;
  EXPECT_TRUE(fs::exists(folder_ / "plans/storey-1.png"));
  EXPECT_FALSE(fs::exists(folder_ / "plans/storey-2.png"));
}

TEST_F(Inspect, PagesOfPlansAreToScale) {
  const auto pageWidth = [&](const std::string& scale) {
    const Ended drawn = run({"inspect", getPath("room.obj"), "--plan", getPath("pages"),
                             "--plan-format", "svg", "--plan-scale", scale});
    EXPECT_EQ(drawn.code, 0) << drawn.err;
    const std::string svg = readText(getPath("pages/storey-1.svg"));
    EXPECT_EQ(svg.rfind("<?xml", 0), 0u);
    std::smatch width;
    EXPECT_TRUE(std::regex_search(svg, width, std::regex("viewBox=\"0 0 ([0-9.]+)")));
    return std::stod(width[1]);
  };
  const double coarse = pageWidth("20"), fine = pageWidth("10");
  const double margins = 2 * coarse - fine;
  EXPECT_GT(margins, 40);
  EXPECT_LT(margins, 100);
}

TEST_F(Inspect, ADamagedRecordingIsNoUnknownModel) {
  write(getPath("x.mcap"), "garbage");
  const Ended ended = run({"inspect", getPath("x.mcap")});
  EXPECT_EQ(ended.code, 1);
  EXPECT_NE(ended.err.find("x.mcap: not an MCAP file by its first bytes"), std::string::npos)
      << ended.err;
}

TEST_F(Inspect, WrongUsageExitsWithTwoAndUnreadableFilesWithOne) {
  const std::vector<std::vector<std::string>> mistakes{
      {"inspect"},
      {"inspect", getPath("room.obj"), getPath("room.obj")},
      {"inspect", getPath("room.obj"), "--plan"},
      {"inspect", getPath("room.obj"), "--plan", ""},
      {"inspect", getPath("room.obj"), "--plan-format", "dxf"},
      {"inspect", getPath("room.obj"), "--plan-scale", "0"},
      {"inspect", getPath("room.obj"), "--plan-format", "svg"},
      {"inspect", getPath("room.obj"), "--plan-scale", "50"},
      {"inspect", getPath("room.obj"), "--plan", getPath("pages"), "--plan-scale", "50"},
      {"inspect", getPath("room.obj"), "--strict", "--accept", "no_unti"},
      {"inspect", getPath("room.obj"), "--accept", "no_unit"},
      {"inspect", getPath("room.obj"), "--html", ""},
      {"inspect", getPath("room.obj"), "--jsno"},
      {"inspect", getPath("room.obj"), "--up", "North"}};
  for (const auto& arguments : mistakes) {
    const Ended ended = run(arguments);
    EXPECT_EQ(ended.code, 2) << ::testing::PrintToString(arguments);
    EXPECT_EQ(ended.out, "");
    EXPECT_NE(ended.err.find("inspect --help"), std::string::npos) << ended.err;
  }
  for (const std::string& file : {getPath("absent.obj"), folder_.string()}) {
    const Ended ended = run({"inspect", file});
    EXPECT_EQ(ended.code, 1);
    EXPECT_EQ(ended.out, "");
    EXPECT_NE(ended.err.find(file), std::string::npos) << ended.err;
  }
}

TEST_F(Inspect, AnUnwritablePlanIsReportedBeforeTheImport) {
  write(getPath("file"), "in the way");
  for (const std::string& folder :
       {getPath("file"), getPath("file") + "/below", std::string("/proc/x")}) {
    const Ended ended = run({"inspect", getPath("absent.obj"), "--plan", folder});
    EXPECT_EQ(ended.code, 1);
    EXPECT_EQ(ended.out, "");
    EXPECT_NE(ended.err.find("cannot write to " + folder), std::string::npos) << ended.err;
    EXPECT_NE(ended.err.find("--plan"), std::string::npos) << ended.err;
  }
  EXPECT_EQ(readText(getPath("file")), "in the way");
}

TEST_F(Inspect, UnwritableFilesAreNamedAndExitWithOne) {
  fs::create_symlink("/dev/full", getPath("stdout"));
  EXPECT_EQ(awaitExitCode(start({"inspect", getPath("room.obj"), "--json"})), 1);
  EXPECT_NE(readText(getPath("stderr")).find("stdout"), std::string::npos)
      << readText(getPath("stderr"));
  fs::remove(getPath("stdout"));
  fs::create_directories(getPath("plans/storey-1.png"));  // blocks the path of the image
  const Ended ended = run({"inspect", getPath("room.obj"), "--plan", getPath("plans")});
  EXPECT_EQ(ended.code, 1);
  EXPECT_NE(ended.err.find("storey-1.png"), std::string::npos) << ended.err;
}

TEST_F(Inspect, TheVersionHasCommitAndBuildType) {
  const Ended printed = run({"--version"});
  EXPECT_EQ(printed.code, 0);
  EXPECT_EQ(printed.out, formatVersion() + "\n");
  EXPECT_TRUE(std::regex_match(
      printed.out,
      std::regex(
          R"(enfilade \d+\.\d+\.\d+ \(commit ([0-9a-f]{10,}(-dirty)?|unknown), [\w ]+\)\n)")))
      << printed.out;
  EXPECT_EQ(printed.err, "");
}

}  // namespace
}  // namespace enfilade::server::testing
