// Tests of `enfilade export SCENE --glb FILE`.
#include "tests/server/glb_reader.hpp"
#include "tests/server/program_fixture.hpp"

namespace enfilade::server::testing {
namespace {

class ExportScene : public ProgramFixture {};

TEST_F(ExportScene, ReadsBackAsTheSameScene) {
  const Ended exported =
      run({"export", getPath("room.obj"), "--unit", "m", "--glb", getPath("room.glb")});
  ASSERT_EQ(exported.code, 0) << exported.err;
  const auto report = nlohmann::json::parse(exported.out);
  EXPECT_EQ(report.at("objects"), 3);
  EXPECT_EQ(report.at("triangles"), 36);
  EXPECT_EQ(report.at("draw_calls"), 1);
  const std::string bytes = readText(getPath("room.glb"));
  EXPECT_EQ(report.at("bytes"), bytes.size());
  EXPECT_EQ(GlbReader(bytes).collectDrawnTriangles().size(), 36u);

  const Ended original = run({"inspect", getPath("room.obj"), "--unit", "m", "--json"});
  const Ended copy = run({"inspect", getPath("room.glb"), "--json"});
  ASSERT_EQ(copy.code, 0) << copy.err;
  for (const char* key : {"triangles", "bounds"})
    EXPECT_EQ(nlohmann::json::parse(copy.out).at(key), nlohmann::json::parse(original.out).at(key));
}

TEST_F(ExportScene, OptionsOfTheImportApply) {
  const Ended ended =
      run({"export", getPath("room.obj"), "--unit", "cm", "--glb", getPath("room.glb")});
  ASSERT_EQ(ended.code, 0) << ended.err;
  for (const auto& triangle : GlbReader(readText(getPath("room.glb"))).collectDrawnTriangles())
    EXPECT_LE(triangle.corners[0].cwiseAbs().maxCoeff(), 0.1001);
}

TEST_F(ExportScene, FailuresNameFileAndRemedy) {
  const Ended unwritable = run({"export", getPath("room.obj"), "--glb", getPath("none/room.glb")});
  EXPECT_EQ(unwritable.code, 1);
  EXPECT_NE(unwritable.err.find(getPath("none/room.glb")), std::string::npos) << unwritable.err;
  EXPECT_NE(unwritable.err.find("the folder must exist"), std::string::npos) << unwritable.err;
  const Ended missing = run({"export", getPath("no.obj"), "--glb", getPath("room.glb")});
  EXPECT_EQ(missing.code, 1);
  EXPECT_NE(missing.err.find("no.obj"), std::string::npos) << missing.err;
  EXPECT_FALSE(std::filesystem::exists(getPath("room.glb")));
}

TEST_F(ExportScene, ModelsAndRecordingsHaveAnOptionEach) {
  EXPECT_EQ(run({"export", getPath("room.obj")}).code, 2);
  EXPECT_EQ(
      run({"export", getPath("room.obj"), "--glb", getPath("a.glb"), "--out", getPath("a")}).code,
      2);
  const Ended mixed = run({"export", getPath("walk.mcap"), "--unit", "m", "--out", getPath("a")});
  EXPECT_EQ(mixed.code, 2);
  EXPECT_NE(mixed.err.find("--unit needs a model"), std::string::npos) << mixed.err;
  write(folder_ / "walk.mcap", "\x89MCAP0\r\n");
  const Ended recording = run({"export", getPath("walk.mcap"), "--glb", getPath("a.glb")});
  EXPECT_EQ(recording.code, 2);
  EXPECT_NE(recording.err.find("a recording"), std::string::npos) << recording.err;
}

}  // namespace
}  // namespace enfilade::server::testing
