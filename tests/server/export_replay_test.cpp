// Tests of `enfilade export RECORDING --html FILE`: the file's parts, its limit, and its errors.
#include <filesystem>
#include <fstream>

#include "server/commands/replay_html.hpp"
#include "tests/server/program_fixture.hpp"

namespace enfilade::server::testing {
namespace {

namespace fs = std::filesystem;

std::size_t countOccurrences(const std::string& text, const std::string& word) {
  std::size_t count = 0;
  for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1))
    ++count;
  return count;
}

class ReplayHtml : public ProgramFixture {
 protected:
  void writePart(const std::string& name, const std::string& text) {
    fs::create_directories(folder_ / "page/replay");
    std::ofstream(folder_ / "page/replay" / name, std::ios::binary) << text;
  }
  void writePage(const std::string& script = "start();") {
    writePart("replay.js", script);
    writePart("replay.css", "p { color: red; }");
    writePart("licenses.txt", "three (MIT) <author@example.org>");
  }
};

TEST_F(ReplayHtml, HoldsAllPartsAndNoTextOfTheSceneAsMarkup) {
  writePage();
  const std::vector<std::uint8_t> scene{1, 2, 3}, messages{255};
  const ReplayContent content{"<b>walk</b>", scene, messages, R"([{"avatar":"</script><b>ann"}])",
                              R"([["Model","<i>house"]])"};
  const std::string html = makeReplayHtml(readReplayPage(folder_ / "page"), content, "bm9uY2U=");
  EXPECT_NE(html.find("<title>&lt;b&gt;walk&lt;/b&gt;</title>"), std::string::npos);
  EXPECT_NE(html.find("script-src 'nonce-bm9uY2U='"), std::string::npos);
  EXPECT_NE(html.find("<script nonce=\"bm9uY2U=\">start();</script>"), std::string::npos);
  EXPECT_NE(html.find(">AQID</script>"), std::string::npos);
  EXPECT_NE(html.find(">/w==</script>"), std::string::npos);
  EXPECT_EQ(html.find("<b>"), std::string::npos);
  EXPECT_EQ(html.find("<i>"), std::string::npos);
  EXPECT_EQ(countOccurrences(html, "<script"), 6u);
  EXPECT_EQ(countOccurrences(html, "</script>"), 6u);
}

TEST_F(ReplayHtml, AMissingPageIsAnErrorWithARemedy) {
  try {
    readReplayPage(folder_ / "page");
    FAIL() << "no error";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("./dev build"), std::string::npos) << error.what();
  }
}

TEST_F(ReplayHtml, AScriptThatWouldEndItsElementIsRefused) {
  writePage("const text = '</SCRIPT>';");
  EXPECT_THROW(readReplayPage(folder_ / "page"), std::runtime_error);
}

TEST_F(ReplayHtml, WrongUsageExitsWithTwo) {
  write(folder_ / "model.obj", makeSmallRoomObj());
  const std::vector<std::vector<std::string>> mistakes{
      {"export", getPath("model.obj"), "--html", getPath("a.html")},
      {"export", getPath("model.obj"), "--html", getPath("a.html"), "--glb", getPath("a.glb")},
      {"export", getPath("model.obj"), getPath("model.obj"), "--glb", getPath("a.glb")},
      {"export", getPath("model.obj"), "--glb", getPath("a.glb"), "--max-size", "7"},
      {"export", getPath("model.obj"), "--html", getPath("a.html"), "--max-size", "0"}};
  for (const auto& arguments : mistakes) {
    const Ended ended = run(arguments);
    EXPECT_EQ(ended.code, 2) << ::testing::PrintToString(arguments) << ended.err;
    EXPECT_FALSE(fs::exists(folder_ / "a.html"));
  }
}

}  // namespace
}  // namespace enfilade::server::testing
