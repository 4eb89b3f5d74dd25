// Each rule twice: on made-up sources that break it, and on the repository itself.
#include <gtest/gtest.h>

#include <iostream>
#include <numeric>

#include "tests/architecture/architecture_rules.hpp"

namespace enfilade::architecture {
namespace {

const Sources& getRepository() {
  static const Sources sources = readSources(ENFILADE_SOURCE_DIR);
  return sources;
}

std::string listFaults(const Faults& faults) {
  return std::accumulate(faults.begin(), faults.end(), std::string("\n"),
                         [](std::string all, const std::string& one) { return all + one + "\n"; });
}

TEST(Architecture, TheRepositoryIsRead) {
  EXPECT_EQ(getRepository().count("CMakeLists.txt"), 1U);
  EXPECT_EQ(getRepository().count("collision/types.hpp"), 1U);
  EXPECT_EQ(getRepository().count("tests/architecture/architecture_test.cpp"), 1U);
  for (const auto& [path, text] : getRepository())
    EXPECT_EQ(path.rfind("build", 0), std::string::npos);
}

TEST(Architecture, IncludesGoDownwardsOnly) {
  EXPECT_EQ(findWrongIncludes(getRepository()), Faults{})
      << listFaults(findWrongIncludes(getRepository()));
}

TEST(Architecture, NoModulesIncludeOneAnotherInARing) {
  EXPECT_EQ(findIncludeRings(getRepository()), Faults{})
      << listFaults(findIncludeRings(getRepository()));
}

TEST(Architecture, NoThirdPartyShowsInAPublicHeader) {
  const Faults faults = findPublicThirdParties(getRepository());
  EXPECT_EQ(faults, Faults{}) << listFaults(faults);
}

TEST(Architecture, EachThirdPartyStaysInItsFolders) {
  const Faults faults = findMisplacedThirdParties(getRepository());
  EXPECT_EQ(faults, Faults{}) << listFaults(faults);
}

TEST(Architecture, EveryRoomIsDescribed) {
  const Faults faults = findUndescribedRooms(getRepository());
  EXPECT_TRUE(faults.empty()) << listFaults(faults);
}

TEST(Architecture, EveryHeaderIsIncludedOnce) {
  EXPECT_EQ(findHeadersWithoutPragmaOnce(getRepository()), Faults{});
}

TEST(Architecture, EveryHeaderBeginsWithAComment) {
  const Faults faults = findHeadersWithoutComment(getRepository());
  EXPECT_EQ(faults, Faults{}) << listFaults(faults);
}

TEST(Architecture, FilesAreShort) {
  const Faults faults = findLongFiles(getRepository(), 500, 700);
  EXPECT_EQ(faults, Faults{}) << listFaults(faults);
}

TEST(Architecture, EverySourceHasAHeader) {
  const Faults faults = findSourcesWithoutHeader(getRepository());
  EXPECT_EQ(faults, Faults{}) << listFaults(faults);
}

TEST(Architecture, TheProductUsesEveryHeaderOfTheCollisionCore) {
  const Faults faults = findUnreachedHeaders(getRepository());
  EXPECT_EQ(faults, Faults{}) << listFaults(faults);
}

TEST(Architecture, FoldersAreSmall) {
  const Faults faults = findCrowdedFolders(getRepository(), 26);
  EXPECT_EQ(faults, Faults{}) << listFaults(faults);
}

TEST(Architecture, NoOddWordsAreUsed) {
  const Faults faults = findOddWords(getRepository());
  EXPECT_EQ(faults, Faults{}) << listFaults(faults);
}

TEST(Architecture, SentencesOfPagesAndCommentsAreShort) {
  const Faults faults = findLongSentences(getRepository(), 25);
  EXPECT_EQ(faults, Faults{}) << listFaults(faults);
}

TEST(Architecture, FunctionsAreNamedByVerbs) {
  const Faults faults = findNounFunctions(getRepository());
  EXPECT_EQ(faults, Faults{}) << listFaults(faults);
}

TEST(Architecture, NothingIsLeftUnfinished) {
  const Faults faults = findUnfinishedWork(getRepository());
  EXPECT_EQ(faults, Faults{}) << listFaults(faults);
}

TEST(Architecture, EveryBodyKindIsDocumentedAndHasCommands) {
  EXPECT_NE(getRepository().at("scene/model/body_spec.hpp").find(".name = \"hinged\""),
            std::string::npos);
  const Faults faults = findBodyKindsLeftOut(getRepository());
  EXPECT_EQ(faults, Faults{}) << listFaults(faults);
}

TEST(Architecture, EveryDiagnosticHasAMeaning) {
  const Faults faults = findUnexplainedDiagnostics(getRepository());
  EXPECT_EQ(faults, Faults{}) << listFaults(faults);
}

TEST(Architecture, TestsKeepTheirFilesApart) {
  const Faults faults = findSharedTemporaryFiles(getRepository());
  EXPECT_EQ(faults, Faults{}) << listFaults(faults);
}

TEST(Architecture, LinksLeadSomewhere) {
  const Faults faults = findBrokenLinks(getRepository());
  EXPECT_EQ(faults, Faults{}) << listFaults(faults);
}

TEST(ArchitectureRules, AnUpwardIncludeIsAFault) {
  const Sources sources{
      {"scene/world/world.hpp", ""},
      {"collision/shapes/hull.cpp", "#include <vector>\n#include \"scene/world/world.hpp\"\n"},
      {"server/app/main.cpp", "#include \"scene/world/world.hpp\"\n"}};
  EXPECT_EQ(findWrongIncludes(sources),
            Faults{"collision/shapes/hull.cpp:2: collision/ may not include scene/"});
}

TEST(ArchitectureRules, ARoomIncludesOnlyRoomsBelowIt) {
  const Sources sources{
      {"scene/model/model.hpp", ""},
      {"scene/world/world.hpp", ""},
      {"scene/model/shapes/shape.hpp", "#include \"scene/model/model.hpp\"\n"},
      {"scene/physics/solver.cpp", "#include \"scene/model/shapes/shape.hpp\"\n"},
      {"scene/world/world.cpp", "#include \"scene/model/shapes/shape.hpp\"\n"},
      {"scene/import/ifc/ifc_metadata.cpp",
       "#include \"scene/model/model.hpp\"\n#include \"scene/world/world.hpp\"\n"}};
  EXPECT_EQ(findWrongIncludes(sources), Faults{"scene/import/ifc/ifc_metadata.cpp:2: "
                                               "scene/import/ifc/ may not include scene/world/, "
                                               "which is above it"});
}

TEST(ArchitectureRules, ARingOfModulesIsAFault) {
  Sources sources{{"scene/a.hpp", "#include \"scene/b.hpp\"\n"},
                  {"scene/b.hpp", ""},
                  {"scene/b.cpp", "#include \"scene/b.hpp\"\n#include \"scene/c.hpp\"\n"},
                  {"scene/c.hpp", ""},
                  {"server/d.cpp", "#include \"scene/a.hpp\"\n"}};
  EXPECT_EQ(findIncludeRings(sources), Faults{});
  sources["scene/c.cpp"] = "#include \"scene/b.hpp\"\n";
  EXPECT_EQ(findIncludeRings(sources), Faults{"scene/b -> scene/c -> scene/b"});
}

TEST(ArchitectureRules, ANewRoomMustBeListed) {
  const Sources sources{{"scene/model/model.hpp", ""},
                        {"scene/attic/box.cpp", "#include \"scene/model/model.hpp\"\n"}};
  EXPECT_EQ(findWrongIncludes(sources),
            Faults{"scene/attic/box.cpp:1: scene/attic/ is not a known room; add it to kRooms"});
}

TEST(ArchitectureRules, ARoomWithoutDescriptionIsAFault) {
  Sources sources{{"ARCHITECTURE.md", getRepository().at("ARCHITECTURE.md")}};
  EXPECT_TRUE(findUndescribedRooms(sources).empty());
  std::string& text = sources["ARCHITECTURE.md"];
  const std::string row = "`server/navigation/`";
  text.replace(text.find(row), row.size(), "`paths`");
  const Faults faults = findUndescribedRooms(sources);
  ASSERT_EQ(faults.size(), 1U) << listFaults(faults);
  EXPECT_NE(faults[0].find("server/navigation/"), std::string::npos);
}

TEST(ArchitectureRules, ADiagnosticWithoutMeaningIsAFault) {
  const Sources sources{
      {"scene/model/diagnostic_catalog.cpp", "DiagnosticKind{\"far_object\", true, \"far\"}\n"},
      {"scene/import/one.cpp",
       "problems.push_back({\"far_object\", name});\nx({\n\"other\", 1});\n"},
      {"scene/import/two.cpp", "addDiagnostic(model_,\n  \"no_words\", name);\n"},
      {"scene/import/three.cpp", "facts.problems.push_back(\n  {\"no_sense\", 1, name});\n"}};
  EXPECT_EQ(
      findUnexplainedDiagnostics(sources),
      (Faults{
          "scene/import/three.cpp:1: \"no_sense\" is not in scene/model/diagnostic_catalog.cpp",
          "scene/import/two.cpp:1: \"no_words\" is not in scene/model/diagnostic_catalog.cpp"}));
}

TEST(ArchitectureRules, ABodyKindThatAFileLeavesOutIsAFault) {
  const Sources sources{
      {"scene/model/body_spec.hpp", "return {.name = \"gate\"};\nreturn {.name = \"crane\"};\n"},
      {"protocol/enfilade.proto", "  string kind = 3;  // \"gate\" or \"crane\"\n"},
      {"scene/import/bodies/SIDECAR.md", "A `crane`:\n| `gate` | axis |\n"},
      {"server/page/src/panels/pick.ts",
       "const ACTIONS = {\n  crane: [],\n};\nconst OTHERS = {\n  gate: [],\n};\n"}};
  EXPECT_EQ(findBodyKindsLeftOut(sources),
            (Faults{"server/page/src/panels/pick.ts: no body kind \"gate\"",
                    "scene/import/bodies/SIDECAR.md: no body kind \"crane\""}));
}

TEST(ArchitectureRules, ASourceWithoutHeaderIsAFault) {
  const Sources sources{{"scene/model/shape.cpp", ""},
                        {"scene/model/model.cpp", ""},
                        {"scene/model/model.hpp", ""},
                        {"server/app/main.cpp", ""},
                        {"tests/scene/shape_test.cpp", ""}};
  EXPECT_EQ(findSourcesWithoutHeader(sources),
            Faults{"scene/model/shape.cpp: no header of the same name"});
}

TEST(ArchitectureRules, ACollisionHeaderForTestsAloneIsAFault) {
  const Sources sources{
      {"scene/world/world.cpp", "#include \"collision/compound/parts.hpp\"\n"},
      {"collision/compound/parts.hpp", ""},
      {"collision/compound/parts.cpp", "#include \"collision/shapes/hull.hpp\"\n"},
      {"collision/shapes/hull.hpp", ""},
      {"collision/motion/heap.hpp", "#include \"collision/motion/pair.hpp\"\n"},
      {"collision/motion/heap.cpp", "#include \"collision/motion/heap.hpp\"\n"},
      {"collision/motion/pair.hpp", ""},
      {"tests/collision/heap_test.cpp", "#include \"collision/motion/heap.hpp\"\n"}};
  EXPECT_EQ(
      findUnreachedHeaders(sources),
      (Faults{"collision/motion/heap.hpp: the product does not use it; use it or delete it",
              "collision/motion/pair.hpp: the product does not use it; use it or delete it"}));
}

TEST(ArchitectureRules, ACrowdedFolderIsAFault) {
  const Sources sources{{"scene/model/a.cpp", ""},
                        {"scene/model/a.hpp", ""},
                        {"scene/model/b.hpp", ""},
                        {"scene/model/shapes/c.hpp", ""},
                        {"scene/model/README.md", ""}};
  EXPECT_EQ(findCrowdedFolders(sources, 2), Faults{"scene/model/: 3 sources"});
  EXPECT_EQ(findCrowdedFolders(sources, 3), Faults{});
  EXPECT_EQ(findCrowdedFolders({{"server/page/src/a.ts", ""}, {"server/page/src/b.ts", ""}}, 1),
            Faults{"server/page/src/: 2 sources"});
}

TEST(ArchitectureRules, AnOddWordIsAFault) {
  const Sources sources{
      {"scene/model/a.hpp", "// Whoever was told stands beside it.\nint nearTold, besideIt;\n"},
      {"docs/page.md", "The server reports each contact.\n"},
      {"scene/old.hpp", "struct Mover { Wish wish; };\ndouble nearness, kFewPlaces;\n"}};
  EXPECT_EQ(
      findOddWords(sources),
      (Faults{"scene/model/a.hpp:1: Whoever", "scene/model/a.hpp:1: told",
              "scene/model/a.hpp:1: beside", "scene/old.hpp:1: Mover", "scene/old.hpp:1: Wish",
              "scene/old.hpp:2: nearness", "scene/old.hpp:2: kFewPlaces"}));
}

TEST(ArchitectureRules, ALongSentenceOfAPageIsAFault) {
  const Sources sources{
      {"docs/page.md",
       "# A heading may have five words\n\n"
       "A page - is\n50 %. \"Has it (five\nor) more `words`?\" No.\n"
       "- A list item is\n- one sentence, without\n  a stop\n\n"
       "A paragraph is another\n\none, too.\n"
       "| a | table | has | no | sentences |\n"
       "```\ncode has no sentences either\n```\n"
       "1. The last sentence is long\n"},
      {"scene/page.hpp",
       "// A comment has many\n// words. One of few.\n//   f = a formula of many words\n"
       "int a;  ///< one of each\nint b;  ///< two of each\n"
       "int c = 1;  // Here is one with five.\nuse(\"http://a b c d e f\");\n"}};
  EXPECT_EQ(findLongSentences(sources, 4),
            (Faults{"docs/page.md:4: a sentence of 6 words; split it",
                    "docs/page.md:7: a sentence of 5 words; split it",
                    "docs/page.md:17: a sentence of 5 words; split it",
                    "scene/page.hpp:1: a sentence of 5 words; split it",
                    "scene/page.hpp:6: a sentence of 5 words; split it"}));
}

TEST(ArchitectureRules, ACommentWithoutASubjectIsAFault) {
  const Sources sources{{"scene/model/a.hpp",
                         "/// Who waits.\nint n;  ///< Which one\n  // What comes, comes.\n"
                         "// Where it is red, stop.\n/// Whatever is left.\n"
                         "// It waits. What comes, comes.\n// What is it? Which is red?\n"},
                        {"tool.py", "# Which one: the last.\n#: Who\n"}};
  EXPECT_EQ(findOddWords(sources),
            (Faults{"scene/model/a.hpp:1: a comment about \"Who\"; name the thing",
                    "scene/model/a.hpp:3: a comment about \"What\"; name the thing",
                    "scene/model/a.hpp:6: a comment about \"What\"; name the thing",
                    "tool.py:1: a comment about \"Which\"; name the thing"}));
}

TEST(ArchitectureRules, AFunctionNamedByANounIsAFault) {
  const Sources sources{
      {"scene/model/a.cpp",
       "double areaOf(const Box& box);\n/// As bodyOf().\nauto all = box.cornersOf<3>(sizeof(x));\n"
       "int at = entry.partOf, out_of(3), byIndexOfBody(2), TypeOf(1);\n"},
      {"scene/model/a.py", "areaOf(box)\n"},
      {"server/page/src/a.ts", "text.indexOf(a.lastIndexOf(b));\nthis.#treeOf(mesh);\n"},
      {"tests/page/a_test.mjs", "const place = async () => placeOf(1);\n"},
      {"tests/scene/a_test.cpp", "areaOf(box);\n"}};
  const std::string remedy = "(); name it by a verb, as get.., find.., compute.. or make..";
  EXPECT_EQ(
      findNounFunctions(sources),
      (Faults{"scene/model/a.cpp:1: areaOf" + remedy, "scene/model/a.cpp:2: bodyOf" + remedy,
              "scene/model/a.cpp:3: cornersOf" + remedy, "server/page/src/a.ts:2: treeOf" + remedy,
              "tests/page/a_test.mjs:1: placeOf" + remedy}));
}

TEST(ArchitectureRules, ATestsFileUnderASharedNameIsAFault) {
  const Sources sources{
      {"tests/support/temporary_folder.hpp", "std::filesystem::temp_directory_path() / own\n"},
      {"tests/server/one_test.cpp", "\nconst auto file = testing::TempDir() + \"one\";\n"}};
  EXPECT_EQ(findSharedTemporaryFiles(sources),
            Faults{"tests/server/one_test.cpp:2: files of a test come from "
                   "tests/support/temporary_folder.hpp"});
}

TEST(ArchitectureRules, ProtocolKnowsNobody) {
  const Sources sources{
      {"collision/shapes/hull.hpp", ""},
      {"protocol/clients/cpp/client.cpp", "#include \"collision/shapes/hull.hpp\"\n"}};
  EXPECT_EQ(findWrongIncludes(sources).size(), 1U);
}

TEST(ArchitectureRules, NoFolderMayIncludeTheTests) {
  const Sources sources{{"tests/support/still.hpp", ""},
                        {"server/app/main.cpp", "#include \"tests/support/still.hpp\"\n"}};
  EXPECT_EQ(findWrongIncludes(sources).size(), 1U);
}

TEST(ArchitectureRules, AnIncludeNotFromTheRootIsAFault) {
  const Sources sources{{"scene/world/world.hpp", ""},
                        {"scene/world/world.cpp", "#include \"world.hpp\"\n"}};
  EXPECT_EQ(findWrongIncludes(sources).size(), 1U);
}

TEST(ArchitectureRules, AFolderWithoutRulesIsAFault) {
  const Sources sources{{"scene/world/world.hpp", ""},
                        {"extra/a.cpp", "#include \"scene/world/world.hpp\"\n"}};
  EXPECT_EQ(findWrongIncludes(sources).size(), 1U);
}

TEST(ArchitectureRules, AThirdPartyBehindAPublicHeaderIsFound) {
  const Sources sources{
      {"scene/world/world.hpp", "#include <Eigen/Core>\n#include \"scene/inner.hpp\"\n"},
      {"scene/inner.hpp", "#include <memory>\n#include <assimp/scene.h>\n"},
      {"render/draw.cpp", "#include \"scene/world/world.hpp\"\n#include <epoxy/gl.h>\n"}};
  EXPECT_EQ(findPublicThirdParties(sources),
            Faults{"scene/inner.hpp:2: <assimp/scene.h> in a header that other folders reach; "
                   "move it into a .cpp file"});
}

TEST(ArchitectureRules, AHeaderOfOneFolderAloneMayShowItsThirdParty) {
  const Sources sources{{"server/net/session.hpp", "#include <boost/asio/ip/tcp.hpp>\n"},
                        {"server/net/session.cpp", "#include \"server/net/session.hpp\"\n"}};
  EXPECT_EQ(findPublicThirdParties(sources), Faults{});
}

TEST(ArchitectureRules, AThirdPartyInAForeignFolderIsFound) {
  const Sources sources{{"collision/shapes/hull.cpp", "#include <gmpxx.h>\n"},
                        {"scene/import.cpp", "#include <gmpxx.h>\n"},
                        {"scene/log.cpp", "#include <spdlog/spdlog.h>\n"},
                        {"collision/tree.cpp", "#include <boost/geometry.hpp>\n"},
                        {"server/net/listen.cpp", "#include <boost/asio.hpp>\n"},
                        {"server/network/ask.cpp", "#include <boost/asio.hpp>\n"},
                        {"server/app/line.cpp", "#include <CLI/CLI.hpp>\n"},
                        {"server/base/line.cpp", "#include <CLI/CLI.hpp>\n"}};
  EXPECT_EQ(findMisplacedThirdParties(sources).size(), 5U);
}

TEST(ArchitectureRules, ALongFileIsFound) {
  const Sources sources{{"protocol/a.py", "\n\n\n"}, {"scene/b.cpp", "\n\n\n"},
                        {"server/c.ts", "\n\n"},     {"tests/d_test.py", "\n\n\n"},
                        {"tests/e.cpp", "\n\n\n\n"}, {"f.proto", "\n\n\n\n\n\n"}};
  EXPECT_EQ(findLongFiles(sources, 2, 3),
            (Faults{"protocol/a.py: 3 lines", "scene/b.cpp: 3 lines", "tests/e.cpp: 4 lines"}));
}

TEST(ArchitectureRules, SmallFaultsAreFound) {
  const std::string word = std::string("TO") + "DO";
  const Sources sources{{"a.hpp", "int a;\n// " + word + ": more\nint b;\n"},
                        {"b.md", "see [the code](a.hpp) and [nothing](c.hpp#top)\n"}};
  EXPECT_EQ(findHeadersWithoutPragmaOnce(sources), Faults{"a.hpp: no #pragma once"});
  EXPECT_EQ(findHeadersWithoutComment({{"scene/model/a.hpp", "#pragma once\n// Late.\n"},
                                       {"scene/model/b.hpp", "// A body.\n#pragma once\n"},
                                       {"tests/c.hpp", "#pragma once\n"}}),
            Faults{"scene/model/a.hpp: does not begin with a comment that says what it is"});
  EXPECT_EQ(findOddWords(
                {{"scene/a.cpp", "constexpr int kMostParts = 1, kLeastArea = 2, kMostly = 3;\n"}}),
            (Faults{"scene/a.cpp:1: kMostParts", "scene/a.cpp:1: kLeastArea"}));
  EXPECT_EQ(findOddWords({{"a.cpp", "float kFarthest = 0, kFar = 1;\n"},
                          {"b.py", "_MOST_PARTS = 3\nLARGEST = 4\nALMOST = 5\n"}}),
            (Faults{"a.cpp:1: kFarthest", "b.py:1: _MOST_PARTS", "b.py:2: LARGEST"}));
  EXPECT_EQ(findUnfinishedWork(sources), Faults{"a.hpp:2: // " + word + ": more"});
  EXPECT_EQ(findBrokenLinks(sources), Faults{"b.md:1: links to c.hpp, which is not there"});
}

}  // namespace
}  // namespace enfilade::architecture
