#include "protocol/script/script_run.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "tests/support/temporary_folder.hpp"

namespace enfilade::protocol {
namespace {

/// The error message for `text`; "" if it is valid.
std::string catchError(std::string_view text) {
  try {
    parseScript(text, "tour.jsonl");
  } catch (const ScriptError& error) {
    return error.what();
  }
  return "";
}

void expectError(std::string_view text, const std::string& start) {
  const std::string error = catchError(text);
  EXPECT_TRUE(error.starts_with(start))
      << text << "\n  said: " << error << "\n  and not: " << start;
}

v1::Command parseCommand(std::string_view text) {
  const Script script = parseScript(text, "tour.jsonl");
  EXPECT_EQ(script.lines.size(), 1u);
  return std::get<v1::Command>(script.lines.at(0).action);
}

TEST(Script, DeeplyNestedBracketsAreAnError) {
  const std::string nest = std::string(200'000, '[') + std::string(200'000, ']');
  for (const std::string& line : {nest, R"({"walk":"ann","to":)" + nest + "}"})
    EXPECT_TRUE(catchError(line).ends_with("a too deeply nested value"));
}

TEST(Script, ASpawnHasItsPositionAndOptions) {
  const v1::Command plain = parseCommand(R"({"spawn":"ann","at":[1,-2.5,3e2]})");
  EXPECT_EQ(plain.avatar(), "ann");
  EXPECT_EQ(plain.tag(), 1u);
  EXPECT_EQ(plain.spawn().at().x(), 1);
  EXPECT_EQ(plain.spawn().at().y(), -2.5);
  EXPECT_EQ(plain.spawn().at().z(), 300);
  EXPECT_EQ(plain.spawn().facing(), 0);
  EXPECT_FALSE(plain.spawn().has_radius());
  EXPECT_FALSE(plain.spawn().has_height());
  const v1::Command full =
      parseCommand(R"({"at":[0,0,0],"height":1.2,"facing":-90,"spawn":"B.o-b_2","radius":0.25})");
  EXPECT_EQ(full.avatar(), "B.o-b_2");
  EXPECT_EQ(full.spawn().facing(), -90);
  EXPECT_EQ(full.spawn().radius(), 0.25);
  EXPECT_EQ(full.spawn().height(), 1.2);
}

TEST(Script, AWalkGoesToOnePointOrAlongMany) {
  const v1::Command to = parseCommand(R"({"walk":"ann","to":[1,2,3],"speed":1.5})");
  ASSERT_EQ(to.walk().along_size(), 1);
  EXPECT_EQ(to.walk().along(0).z(), 3);
  EXPECT_EQ(to.walk().speed(), 1.5);
  const v1::Command along = parseCommand(R"({"walk":"ann","along":[[1,2,3],[4,5,6]]})");
  ASSERT_EQ(along.walk().along_size(), 2);
  EXPECT_EQ(along.walk().along(1).y(), 5);
  EXPECT_FALSE(along.walk().has_speed());
}

TEST(Script, LookWaitCaptureAndLeaveAreRead) {
  EXPECT_EQ(parseCommand(R"({"look":"ann","at":[1,2,3]})").look().at().y(), 2);
  const v1::Command wait = parseCommand(R"({"wait":0.5,"for":"ann"})");
  EXPECT_EQ(wait.avatar(), "ann");
  EXPECT_EQ(wait.wait().seconds(), 0.5);
  EXPECT_EQ(parseCommand(R"({"capture":"ann","as":"hall.1"})").capture().as(), "hall.1");
  EXPECT_TRUE(parseCommand(R"({"leave":"ann"})").has_leave());
}

TEST(Script, AWaitWithoutForIsForAll) {
  const Script script = parseScript(R"({"wait":2})", "s");
  EXPECT_EQ(std::get<GlobalWait>(script.lines.at(0).action).seconds, 2);
}

TEST(Script, BlankLinesCommentsBomAndCarriageReturnsAreTolerated) {
  const Script script = parseScript(
      "\xEF\xBB\xBF# a comment \xC3\xA9\r\n\r\n  \t\n{\"wait\":1}\r\n// more\n  # and {more}\n"
      " {\"leave\":\"ann\"} ",
      "s");
  ASSERT_EQ(script.lines.size(), 2u);
  EXPECT_EQ(script.lines[0].number, 4u);
  EXPECT_EQ(script.lines[1].number, 7u);
  EXPECT_EQ(std::get<v1::Command>(script.lines[1].action).tag(), 7u);
  EXPECT_TRUE(parseScript("", "s").lines.empty());
  EXPECT_TRUE(parseScript("\xEF\xBB\xBF", "s").lines.empty());
}

TEST(Script, WrongTypesAreReportedWithTheField) {
  expectError(R"({"walk":"ann","to":"door"})",
              "tour.jsonl:1: to: must be three numbers [x, y, z] in metres, not \"door\"");
  expectError(R"({"walk":"ann","to":[1,2]})", "tour.jsonl:1: to: must be three numbers");
  expectError(R"({"walk":"ann","to":[1,null,3]})", "tour.jsonl:1: to.y: must be a number");
  expectError(R"({"walk":"ann","along":[[1,2,3],[1,2,true]]})",
              "tour.jsonl:1: along[1].z: must be a number");
  expectError(R"({"walk":"ann","along":[]})", "tour.jsonl:1: along: must be a list of points");
  expectError(R"({"walk":"ann","to":[1,2,3],"speed":"fast"})", "tour.jsonl:1: speed: must be");
  expectError(R"({"spawn":"ann","at":[0,0,0],"facing":[1]})", "tour.jsonl:1: facing: must be");
  expectError(R"({"spawn":7,"at":[0,0,0]})", "tour.jsonl:1: spawn: must be the avatar's name");
  expectError(R"({"wait":"long"})", "tour.jsonl:1: wait: must be a number of seconds");
  expectError(R"({"wait":1,"for":2})", "tour.jsonl:1: for: must be the avatar's name");
  expectError(R"([1,2])", "tour.jsonl:1: must be an object");
}

TEST(Script, MissingKeysAreReportedWithARemedy) {
  expectError(R"({"spawn":"ann"})", R"(tour.jsonl:1: at: is missing; add "at":[x,y,z])");
  expectError(R"({"look":"ann"})", "tour.jsonl:1: at: is missing");
  expectError(R"({"walk":"ann"})", "tour.jsonl:1: to: is missing");
  expectError(R"({"capture":"ann"})", "tour.jsonl:1: as: is missing");
  expectError(R"({})", "tour.jsonl:1: no command; a line needs one of spawn, walk, go, look");
  expectError(R"({"for":"ann"})", "tour.jsonl:1: no command");
}

TEST(Script, UnknownRepeatedAndConflictingKeysAreReported) {
  expectError(R"({"walk":"ann","to":[1,2,3],"sped":2})",
              R"(tour.jsonl:1: "sped" is not a key of the command walk; its keys are walk, to)");
  expectError(R"({"hop":"ann"})", "tour.jsonl:1: no command");
  expectError(R"({"spwan":"ann","at":[0,0,0]})",
              "tour.jsonl:1: \"spwan\" is not a command; did you mean \"spawn\"?");
  expectError(R"({"leave":"ann","leave":"bob"})", "tour.jsonl:1: leave: occurs twice");
  expectError(R"({"walk":"ann","to":[1,2,3],"along":[[1,2,3]]})",
              R"(tour.jsonl:1: to: cannot be combined with "along")");
  expectError(R"({"walk":"ann","leave":"ann"})",
              R"(tour.jsonl:1: "walk" and "leave" are in one line)");
}

TEST(Script, NonFiniteNumbersAreRefused) {
  for (const char* bad : {"NaN", "nan", "Infinity", "-inf", "1e", "0x10", "+1", "01", ".5"}) {
    expectError(R"({"wait":)" + std::string(bad) + "}", "tour.jsonl:1: is not JSON at column ");
  }
  for (const char* huge : {"1e400", "-1e400", "1e999999999"}) {
    expectError(R"({"walk":"ann","to":[0,0,)" + std::string(huge) + "]}",
                "tour.jsonl:1: a number exceeds the range of a double");
  }
  expectError(R"({"wait":-1})",
              "tour.jsonl:1: wait: -1 is out of range; give a number of seconds from 0 to 1000000");
  expectError(R"({"wait":1e300})", "tour.jsonl:1: wait: ");
  expectError(R"({"wait":-0.1,"for":"ann"})", "tour.jsonl:1: wait: -0.1 is out of range");
}

TEST(Script, NumbersOutOfRangeAreRefusedBeforeTheWalk) {
  expectError(R"({"spawn":"a","at":[2e7,0,0]})", "tour.jsonl:1: at.x: ");
  expectError(R"({"spawn":"a","at":[0,0,0],"radius":0.01})", "tour.jsonl:1: radius: ");
  expectError(R"({"spawn":"a","at":[0,0,0],"height":11})", "tour.jsonl:1: height: ");
  expectError(R"({"spawn":"a","at":[0,0,0],"facing":1e7})", "tour.jsonl:1: facing: ");
  expectError(R"({"walk":"a","to":[0,0,0],"speed":0})", "tour.jsonl:1: speed: ");
  expectError(R"({"walk":"a","to":[0,0,0],"speed":1001})", "tour.jsonl:1: speed: ");
  expectError(R"({"wait":86401,"for":"a"})", "tour.jsonl:1: wait: ");
  expectError(R"({"jump":"a","height":0})", "tour.jsonl:1: height: ");
  expectError(
      R"({"crouch":"a","height":-1})",
      "tour.jsonl:1: height: -1 is out of range; give a number of metres above 0 and at most 10");
  expectError(R"({"joints":"a","to":[1e4]})", "tour.jsonl:1: to[0]: ");
  expectError(R"({"joints":"a","to":[1],"speed":21})", "tour.jsonl:1: speed: ");
}

TEST(Script, JumpsFlightsCrouchesAndJointsAreRead) {
  const v1::Command jump = parseCommand(R"({"jump":"ann","height":0.4,"velocity":[2,0,1]})");
  EXPECT_EQ(jump.jump().height(), 0.4);
  EXPECT_EQ(jump.jump().velocity().z(), 1);
  EXPECT_FALSE(parseCommand(R"({"jump":"ann"})").jump().has_velocity());
  EXPECT_TRUE(parseCommand(R"({"fly":"ann"})").fly().on());
  EXPECT_FALSE(parseCommand(R"({"fly":"ann","on":false})").fly().on());
  EXPECT_EQ(parseCommand(R"({"crouch":"ann","height":0.9})").crouch().height(), 0.9);
  const v1::Command stand = parseCommand(R"({"stand":"ann"})");
  EXPECT_TRUE(stand.has_crouch());
  EXPECT_FALSE(stand.crouch().has_height());
  const v1::Command joints = parseCommand(R"({"joints":"arm","to":[1.5,null,-0.2],"speed":2})");
  ASSERT_EQ(joints.drive_joints().to_size(), 3);
  EXPECT_EQ(joints.drive_joints().to(0).value(), 1.5);
  EXPECT_FALSE(joints.drive_joints().to(1).has_value());
  EXPECT_EQ(joints.drive_joints().speed(), 2);
}

TEST(Script, ASpawnHasPartsAndLinks) {
  const v1::Command command = parseCommand(
      R"({"spawn":"arm","at":[0,0,0],"self_contact":true,"flying":true,)"
      R"("parts":[{"box":[[-1,0,-1],[1,0.5,1]]},{"points":[[0,0,0],[1,0,0],[0,1,0],[0,0,1]]}],)"
      R"("links":[{"joint":"revolute","axis":[0,1,0],"anchor":[0,0.5,0],"limits":[-1,2],"value":1,)"
      R"("box":[[0,0,0],[1,1,1]]},{"parent":0,"joint":"prismatic","axis":[1,0,0],)"
      R"("points":[[0,0,0]]}]})");
  const v1::Spawn& spawn = command.spawn();
  EXPECT_TRUE(spawn.self_contact());
  EXPECT_TRUE(spawn.flying());
  ASSERT_EQ(spawn.parts_size(), 2);
  EXPECT_EQ(spawn.parts(0).box().max().y(), 0.5);
  EXPECT_EQ(spawn.parts(1).points_size(), 4);
  ASSERT_EQ(spawn.links_size(), 2);
  EXPECT_FALSE(spawn.links(0).has_parent());
  EXPECT_EQ(spawn.links(0).joint().high(), 2);
  EXPECT_EQ(spawn.links(0).value(), 1);
  EXPECT_EQ(spawn.links(1).joint().kind(), v1::Joint::KIND_PRISMATIC);
  expectError(R"({"spawn":"a","at":[0,0,0],"links":[{"axis":[0,1,0]}]})",
              "tour.jsonl:1: links[0].joint: must be");
  expectError(R"({"spawn":"a","at":[0,0,0],"links":[{"joint":"revolute","axis":[0,1,0]}]})",
              "tour.jsonl:1: links[0]: must have either");
  expectError(R"({"spawn":"a","at":[0,0,0],"links":[{"joint":"revolute","axes":[0,1,0]}]})",
              R"(tour.jsonl:1: links[0]: "axes" is not a key)");
  expectError(R"({"spawn":"a","at":[0,0,0],"parts":[{"box":[[0,0,0]]}]})",
              "tour.jsonl:1: parts[0].box: must be two");
}

v1::BodyCommand parseBodyCommand(std::string_view text) {
  const Script script = parseScript(text, "tour.jsonl");
  EXPECT_EQ(script.lines.size(), 1u);
  return std::get<v1::BodyCommand>(script.lines.at(0).action);
}

TEST(Script, ABodyCommandUsesTheBodysUnits) {
  const v1::BodyCommand open = parseBodyCommand(R"({"body":"Hall/Front door","do":"open"})");
  EXPECT_EQ(open.body(), "Hall/Front door");
  EXPECT_TRUE(open.has_open());
  EXPECT_FALSE(open.has_speed());
  EXPECT_TRUE(parseBodyCommand(R"({"body":"d","do":"close"})").has_close());
  EXPECT_TRUE(parseBodyCommand(R"({"body":"d","do":"stop"})").has_stop());
  EXPECT_TRUE(parseBodyCommand(R"({"body":"d","do":"run"})").has_run());
  const v1::BodyCommand turned = parseBodyCommand(R"({"body":"d","turn":90,"turn_speed":45})");
  EXPECT_NEAR(turned.to(), 1.5707963267948966, 1e-15);
  EXPECT_NEAR(turned.speed(), 0.78539816339744831, 1e-15);
  const v1::BodyCommand slid = parseBodyCommand(R"({"body":"gate","to":-0.75,"speed":2})");
  EXPECT_EQ(slid.to(), -0.75);
  EXPECT_EQ(slid.speed(), 2);
  const v1::BodyCommand called = parseBodyCommand(R"({"body":"lift","level":0})");
  EXPECT_TRUE(called.has_level());
  EXPECT_EQ(parseBodyCommand(R"({"body":"lift","level":10000})").level(), 10000u);
}

TEST(Script, AnInvalidBodyLineIsReportedWithItsField) {
  expectError(R"({"body":7,"do":"open"})", "tour.jsonl:1: body: must be a body's name in quotes");
  expectError(R"({"body":"","do":"open"})", "tour.jsonl:1: body: must have 1 to");
  expectError(R"({"body":"d"})", R"(tour.jsonl:1: body: needs one of "do", "to", "turn")");
  expectError(R"({"body":"d","do":"open","to":1})", "tour.jsonl:1: body: needs one of");
  expectError(R"({"body":"d","do":"dance"})", R"(tour.jsonl:1: do: must be "open", "close")");
  expectError(R"({"body":"d","do":1})", "tour.jsonl:1: do: must be");
  expectError(R"({"body":"d","to":"up"})", "tour.jsonl:1: to: must be a number of metres");
  expectError(R"({"body":"d","to":1e999})", "tour.jsonl:1: a number exceeds");
  expectError(R"({"body":"d","turn":NaN})", "tour.jsonl:1: is not JSON");
  expectError(R"({"body":"d","level":-1})", "tour.jsonl:1: level: must be a whole number");
  expectError(R"({"body":"d","level":1.5})", "tour.jsonl:1: level: must be a whole number");
  expectError(R"({"body":"d","level":10001})", "tour.jsonl:1: level: must be a whole number");
  expectError(R"({"body":"d","do":"open","speed":"fast"})", "tour.jsonl:1: speed: must be");
  expectError(R"({"body":"d","do":"open","speed":0})", "tour.jsonl:1: speed: 0 is out of range");
  expectError(R"({"body":"d","turn":1,"turn_speed":-3})",
              "tour.jsonl:1: turn_speed: -3 is out of range");
  expectError(R"({"body":"d","turn":1,"speed":1,"turn_speed":3})",
              R"(tour.jsonl:1: speed: conflicts with "turn_speed")");
  expectError(R"({"body":"d","do":"open","at":[0,0,0]})", R"(tour.jsonl:1: "at" is not a key)");
}

TEST(Script, NamesAreShortAndFitForFiles) {
  expectError(R"({"leave":""})", "tour.jsonl:1: leave: is empty; give the avatar's name");
  expectError(R"({"leave":")" + std::string(65, 'a') + "\"}", "tour.jsonl:1: leave: has 65");
  EXPECT_EQ(catchError(R"({"leave":")" + std::string(64, 'a') + "\"}"), "");
  for (const char* bad : {"../x", "a b", "a/b", "\\u0000", "caf\xC3\xA9", ".hidden"}) {
    expectError(R"({"capture":"ann","as":")" + std::string(bad) + "\"}", "tour.jsonl:1: as: ");
  }
  expectError("{\"capture\":\"ann\",\"as\":\"a\"}\n\n{\"capture\":\"bob\",\"as\":\"a\"}",
              R"(tour.jsonl:3: as: "a" is already used in line 1)");
}

TEST(Script, LinesWithoutExactlyOneObjectAreRefused) {
  expectError(R"({"wait":1} x)", "tour.jsonl:1: is not JSON at column 12");
  expectError(R"({"wait":1}{"wait":1})", "tour.jsonl:1: is not JSON");
  expectError(R"({"wait":1},)", "tour.jsonl:1: is not JSON");
  expectError(R"({"wait":1)", "tour.jsonl:1: is not JSON");
  expectError("{\"leave\":\n\"ann\"}", "tour.jsonl:1: is not JSON");
  expectError("{'wait':1}", "tour.jsonl:1: is not JSON");
  expectError(std::string("{\"wait\":1}\0", 11), "tour.jsonl:1: has a zero byte");
  expectError(std::string(1'000'000, '['), "tour.jsonl:1: is not JSON");
  expectError("{\"leave\":\"" + std::string(1u << 20, 'a') + "\"}", "tour.jsonl:1: has ");
}

TEST(Script, BytesThatAreNotUtf8AreRefusedEvenInComments) {
  expectError("# caf\xE9\n", "tour.jsonl:1: is not UTF-8");
  expectError("{\"wait\":1}\n{\"leave\":\"\xC0\xAF\"}", "tour.jsonl:2: is not UTF-8");
  expectError("\xFF\xFE{\0", "tour.jsonl:1: is not UTF-8");
}

TEST(Script, EveryBadLineIsReportedWithItsNumber) {
  const std::string text = "{\"wait\":1}\n\nnonsense\n{\"leave\":\"\"}\n{\"leave\":\"ann\"}\n";
  const std::string error = catchError(text);
  EXPECT_NE(error.find("tour.jsonl:3: is not JSON"), std::string::npos) << error;
  EXPECT_NE(error.find("\ntour.jsonl:4: leave: is empty"), std::string::npos) << error;
  try {
    parseScript(text, "s");
    FAIL();
  } catch (const ScriptError& thrown) {
    EXPECT_EQ(thrown.line, 3u);
  }
}

TEST(Script, ManyBadLinesAreCounted) {
  std::string text;
  for (int i = 0; i < 1000; ++i) text += "x\n";
  const std::string error = catchError(text);
  EXPECT_TRUE(error.ends_with("and 980 more bad lines")) << error.substr(error.size() - 60);
}

TEST(Script, AFileThatCannotBeReadIsNamed) {
  for (const std::string file : {"/nonexistent/tour.jsonl", "/"}) {
    try {
      readScript(file);
      FAIL() << file;
    } catch (const ScriptError& error) {
      EXPECT_TRUE(std::string(error.what()).starts_with(file + ": ")) << error.what();
      EXPECT_EQ(error.line, 0u);
    }
  }
}

TEST(Script, AFileIsReadAsItsText) {
  const auto file = tests::makeOwnFile("script.jsonl");
  std::ofstream(file, std::ios::binary) << "{\"wait\":1}\r\n{\"leave\":\"ann\"}";
  const Script script = readScript(file);
  EXPECT_EQ(script.source, file.string());
  EXPECT_EQ(script.lines.size(), 2u);
}

}  // namespace
}  // namespace enfilade::protocol
