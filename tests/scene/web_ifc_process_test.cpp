// Tests of the process that executes Node.js, with misbehaving scripts in place of ours.
#include <gtest/gtest.h>

#include <cstdlib>

#include "scene/import/import_model.hpp"
#include "tests/scene/hand_made_files.hpp"
#include "tests/scene/hand_made_ifc.hpp"
#include "tests/scene/import_outcome.hpp"
#include "tests/support/web_ifc_here.hpp"

namespace enfilade::scene {
namespace {

/// A folder with `script` in web-ifc's place, for the lifetime of the object.
class ScriptedNode {
 public:
  explicit ScriptedNode(const std::string& script) {
    std::filesystem::create_directories(folder_.getPath() / "node_modules/web-ifc");
    folder_.write("package.json", R"({"type":"module"})");
    folder_.write("read_ifc.js", kFrames + script);
    setenv("ENFILADE_WEB_IFC", folder_.getPath().c_str(), 1);
  }
  ~ScriptedNode() { unsetenv("ENFILADE_WEB_IFC"); }
  ScriptedNode(const ScriptedNode&) = delete;
  ScriptedNode& operator=(const ScriptedNode&) = delete;

  std::filesystem::path writeHouse(const std::string& text = tests::IfcHouse().makeText()) const {
    return folder_.write("house.ifc", text);
  }

 private:
  static constexpr const char* kFrames = R"(
import fs from 'node:fs';
const first = Number(process.argv[2]);
const words = (...n) => Buffer.from(Uint32Array.from(n).buffer);
const send = (kind, body) => {
  const head = Buffer.alloc(9);
  head.write(kind, 0, 'latin1');
  head.writeBigUInt64LE(BigInt(body.length), 1);
  fs.writeSync(3, Buffer.concat([head, body]));
};
)";
  tests::TemporaryFolder folder_;
};

TEST(WebIfcProcess, AProductThatBringsItDownIsLeftOutAndTheRestIsRead) {
  // The script dies at the first product (the wall, #120) and sends a triangle for the second (the
  // door).
  const ScriptedNode node(R"(
send('T', words(first));
if (first === 0) process.kill(process.pid, 'SIGKILL');
if (first === 1) {
  const vertices = Buffer.from(new Float32Array([0,0,0,0,0,1, 1,0,0,0,0,1, 0,1,0,0,0,1]).buffer);
  send('G', Buffer.concat([words(7, 3, 3), vertices, words(0, 1, 2)]));
  const numbers = new Float64Array([1,0,0,1, 1,0,0,0, 0,1,0,0, 0,0,1,0, 2,0,0,1]);
  send('O', Buffer.concat([words(320, 1), words(7), Buffer.from(numbers.buffer)]));
}
if (first !== 0) send('D', Buffer.alloc(0));
setTimeout(() => {}, first === 0 ? 10000 : 0);
)");
  ENFILADE_NEED_WEB_IFC();
  const Model model = importModel(node.writeHouse());
  EXPECT_EQ(model.reader, "web-ifc");
  ASSERT_EQ(model.objects.size(), 2u);
  EXPECT_NE(findDiagnosticText(model, "openings_unverified").find("000000000000000000Wall"),
            std::string::npos)
      << "ifcplusplus reads the wall";

  ImportOptions alone;
  alone.ifcReader = IfcReader::webIfc;
  const Model left = importModel(node.writeHouse(), alone);
  ASSERT_EQ(left.objects.size(), 1u);
  EXPECT_EQ(left.objects[0].ifcClass, "IfcDoor");
  EXPECT_NE(findDiagnosticText(left, "missing_product").find("was killed"), std::string::npos)
      << findDiagnosticText(left, "missing_product");
}

/// A reader that gives no triangles of the wall, and a sheet for the door: x from 2.2 to 3.1, y up.
constexpr char kDoorAlone[] = R"(
send('T', words(first));
const at = [[2.2, 0], [3.1, 0], [2.2, 2.1], [3.1, 2.1]];
const vertices = Buffer.from(new Float32Array(at.flatMap(p => [p[0], p[1], -0.1, 0, 0, 1])).buffer);
send('G', Buffer.concat([words(7, 4, 6), vertices, words(0, 1, 2, 2, 1, 3)]));
const numbers = new Float64Array([1,0,0,1, 1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]);
send('O', Buffer.concat([words(320, 1), words(7), Buffer.from(numbers.buffer)]));
send('D', Buffer.alloc(0));
)";

/// The house with its hole at 0.2 m and its door at 2.2 m, so that ifcplusplus leaves the wall
/// closed behind the door. `width` and `height`: stated by the door, in metres.
std::string makeClosedHouse(double width, double height) {
  const tests::IfcHouse house;
  std::string text = house.makeText();
  const auto replace = [&](const std::string& what, const std::string& with) {
    const std::size_t at = text.find(what);
    ASSERT_NE(at, std::string::npos) << what;
    text.replace(at, what.size(), with);
  };
  replace("#200=IFCCARTESIANPOINT((" + house.formatLength(1.5),
          "#200=IFCCARTESIANPOINT((" + house.formatLength(0.2));
  replace("#300=IFCCARTESIANPOINT((" + house.formatLength(0),
          "#300=IFCCARTESIANPOINT((" + house.formatLength(2));
  replace("#315,$," + house.formatLength(2.1) + "," + house.formatLength(0.9),
          "#315,$," + house.formatLength(height) + "," + house.formatLength(width));
  return text;
}

TEST(WebIfcProcess, AWallThatNoReaderCutsStaysSolidAndIsReported) {
  const ScriptedNode node(kDoorAlone);
  ENFILADE_NEED_WEB_IFC();
  const Model model = importModel(node.writeHouse(makeClosedHouse(0.9, 2.1)));
  EXPECT_EQ(model.reader, "web-ifc");
  EXPECT_EQ(model.objects.size(), 2u);
  EXPECT_NE(findDiagnosticText(model, "solid_product").find("000000000000000000Wall"),
            std::string::npos);
  EXPECT_NE(findDiagnosticText(model, "openings_unverified").find("000000000000000000Wall"),
            std::string::npos);
  EXPECT_EQ(findDiagnosticText(model, "cut_away_product"), "");
}

TEST(WebIfcProcess, AFramesWallThatIsNoLargerThanItsDoorIsLeftOutAndReported) {
  const ScriptedNode node(kDoorAlone);
  ENFILADE_NEED_WEB_IFC();
  const Model model = importModel(node.writeHouse(makeClosedHouse(4, 3)));
  ASSERT_EQ(model.objects.size(), 1u);
  EXPECT_EQ(model.objects[0].ifcClass, "IfcDoor");
  EXPECT_NE(findDiagnosticText(model, "cut_away_product").find("000000000000000000Wall"),
            std::string::npos);
  EXPECT_EQ(findDiagnosticText(model, "solid_product"), "");
  EXPECT_EQ(findDiagnosticText(model, "missing_product"), "");
}

TEST(WebIfcProcess, ARunawayIsStoppedByItsMemoryLimit) {
  const ScriptedNode node(R"(
const all = [];
for (;;) all.push(Buffer.alloc(1 << 24, 1));
)");
  ENFILADE_NEED_WEB_IFC();
  ImportOptions options;
  options.memoryLimit = std::size_t{700} << 20;
  options.timeLimit = 60;
  const Model model = importModel(node.writeHouse(), options);
  EXPECT_EQ(model.reader, "ifcplusplus");
  const std::string why = findDiagnosticText(model, "ifc_reader_failed");
  EXPECT_TRUE(why.starts_with("web-ifc: ")) << why;
  EXPECT_EQ(why.find("too long"), std::string::npos) << why;
}

TEST(WebIfcProcess, NoiseAndSilenceAreFailures) {
  for (const char* script :
       {"send('X', words(1));", "send('G', words(1, 5, 5));", "", "throw 1;"}) {
    const ScriptedNode node(script);
    ENFILADE_NEED_WEB_IFC();
    const Model model = importModel(node.writeHouse());
    EXPECT_EQ(model.reader, "ifcplusplus") << script;
    EXPECT_NE(findDiagnosticText(model, "ifc_reader_failed"), "") << script;
  }
}

}  // namespace
}  // namespace enfilade::scene
