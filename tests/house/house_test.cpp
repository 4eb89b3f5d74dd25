// Each rule twice: on made-up sources that break it, and on the repository itself.
#include <gtest/gtest.h>

#include <iostream>
#include <numeric>

#include "tests/house/house_rules.hpp"

namespace enfilade::house {
namespace {

const Sources& repository() {
  static const Sources sources = readSources(ENFILADE_SOURCE_DIR);
  return sources;
}

std::string listed(const Faults& faults) {
  return std::accumulate(faults.begin(), faults.end(), std::string("\n"),
                         [](std::string all, const std::string& one) { return all + one + "\n"; });
}

TEST(House, TheRepositoryIsRead) {
  EXPECT_EQ(repository().count("CMakeLists.txt"), 1U);
  EXPECT_EQ(repository().count("collision/types.hpp"), 1U);
  EXPECT_EQ(repository().count("tests/house/house_test.cpp"), 1U);
  for (const auto& [path, text] : repository())
    EXPECT_EQ(path.rfind("build", 0), std::string::npos);
}

TEST(House, IncludesGoDownwardsOnly) {
  EXPECT_EQ(includeDirections(repository()), Faults{}) << listed(includeDirections(repository()));
}

TEST(House, NoThirdPartyShowsInAPublicHeader) {
  const Faults faults = thirdPartiesInPublicHeaders(repository());
  EXPECT_EQ(faults, Faults{}) << listed(faults);
}

TEST(House, EachThirdPartyStaysInItsFolders) {
  const Faults faults = thirdPartiesOutOfPlace(repository());
  EXPECT_EQ(faults, Faults{}) << listed(faults);
}

TEST(House, EveryHeaderIsIncludedOnce) {
  EXPECT_EQ(headersWithoutPragmaOnce(repository()), Faults{});
}

TEST(House, FilesAreShort) {
  const Faults faults = longFiles(repository(), 700);
  EXPECT_EQ(faults, Faults{}) << listed(faults);
  const Faults warnings = longFiles(repository(), 500);
  if (!warnings.empty()) std::cout << "over 500 lines:" << listed(warnings);
}

TEST(House, NothingIsLeftUnfinished) {
  const Faults faults = unfinishedWork(repository());
  EXPECT_EQ(faults, Faults{}) << listed(faults);
}

TEST(House, EveryProblemHasAMeaning) {
  const Faults faults = problemsWithoutMeaning(repository());
  EXPECT_EQ(faults, Faults{}) << listed(faults);
}

TEST(House, TestsKeepTheirFilesApart) {
  const Faults faults = sharedTemporaryFiles(repository());
  EXPECT_EQ(faults, Faults{}) << listed(faults);
}

TEST(House, LinksLeadSomewhere) {
  const Faults faults = brokenLinks(repository());
  EXPECT_EQ(faults, Faults{}) << listed(faults);
}

TEST(HouseRules, AnUpwardIncludeIsAFault) {
  const Sources sources{{"scene/world.hpp", ""},
                        {"collision/hull.cpp", "#include <vector>\n#include \"scene/world.hpp\"\n"},
                        {"server/main.cpp", "#include \"scene/world.hpp\"\n"}};
  EXPECT_EQ(includeDirections(sources),
            Faults{"collision/hull.cpp:2: collision/ may not include scene/"});
}

TEST(HouseRules, ARoomOfTheSceneMayIncludeOnlyWhatItIsToldTo) {
  const Sources sources{{"scene/model.hpp", ""},
                        {"scene/world.hpp", ""},
                        {"scene/shapes/shape.hpp", "#include \"scene/model.hpp\"\n"},
                        {"scene/rigid/solver.cpp", "#include \"scene/shapes/shape.hpp\"\n"},
                        {"scene/world.cpp", "#include \"scene/shapes/shape.hpp\"\n"},
                        {"scene/import/ifc/facts.cpp",
                         "#include \"scene/model.hpp\"\n#include \"scene/world.hpp\"\n"}};
  EXPECT_EQ(includeDirections(sources),
            Faults{"scene/import/ifc/facts.cpp:2: scene/import/ may not include scene/world.hpp"});
}

TEST(HouseRules, AProblemThatIsNotExplainedIsAFault) {
  const Sources sources{
      {"scene/problem_kinds.cpp", "ProblemKind{\"far_object\", true, \"far\"}\n"},
      {"scene/import/one.cpp", "problems.add(\"far_object\", name);\nx({\n\"un_told\", 1});\n"},
      {"scene/import/two.cpp", "addProblem(model_,\n  \"no_words\", name);\n"},
      {"scene/import/three.cpp", "facts.problems.push_back(\n  {\"no_sense\", 1, name});\n"}};
  EXPECT_EQ(problemsWithoutMeaning(sources),
            (Faults{"scene/import/three.cpp:1: \"no_sense\" is not in scene/problem_kinds.cpp",
                    "scene/import/two.cpp:1: \"no_words\" is not in scene/problem_kinds.cpp"}));
}

TEST(HouseRules, ATestsFileUnderASharedNameIsAFault) {
  const Sources sources{
      {"tests/support/temporary_folder.hpp", "std::filesystem::temp_directory_path() / own\n"},
      {"tests/server/one_test.cpp", "\nconst auto file = testing::TempDir() + \"one\";\n"}};
  EXPECT_EQ(sharedTemporaryFiles(sources),
            Faults{"tests/server/one_test.cpp:2: files of a test come from "
                   "tests/support/temporary_folder.hpp"});
}

TEST(HouseRules, ProtocolKnowsNobody) {
  const Sources sources{{"collision/hull.hpp", ""},
                        {"protocol/client.cpp", "#include \"collision/hull.hpp\"\n"}};
  EXPECT_EQ(includeDirections(sources).size(), 1U);
}

TEST(HouseRules, NoFolderMayIncludeTheTests) {
  const Sources sources{{"tests/support/still.hpp", ""},
                        {"server/main.cpp", "#include \"tests/support/still.hpp\"\n"}};
  EXPECT_EQ(includeDirections(sources).size(), 1U);
}

TEST(HouseRules, AnIncludeNotFromTheRootIsAFault) {
  const Sources sources{{"scene/world.hpp", ""}, {"scene/world.cpp", "#include \"world.hpp\"\n"}};
  EXPECT_EQ(includeDirections(sources).size(), 1U);
}

TEST(HouseRules, AFolderWithoutRulesIsAFault) {
  const Sources sources{{"scene/world.hpp", ""}, {"extra/a.cpp", "#include \"scene/world.hpp\"\n"}};
  EXPECT_EQ(includeDirections(sources).size(), 1U);
}

TEST(HouseRules, AThirdPartyBehindAPublicHeaderIsFound) {
  const Sources sources{
      {"scene/world.hpp", "#include <Eigen/Core>\n#include \"scene/inner.hpp\"\n"},
      {"scene/inner.hpp", "#include <memory>\n#include <assimp/scene.h>\n"},
      {"render/draw.cpp", "#include \"scene/world.hpp\"\n#include <epoxy/gl.h>\n"}};
  EXPECT_EQ(thirdPartiesInPublicHeaders(sources),
            Faults{"scene/inner.hpp:2: <assimp/scene.h> in a header that other folders reach; "
                   "move it into a .cpp file"});
}

TEST(HouseRules, AHeaderOfOneFolderAloneMayShowItsThirdParty) {
  const Sources sources{{"server/session.hpp", "#include <boost/asio/ip/tcp.hpp>\n"},
                        {"server/session.cpp", "#include \"server/session.hpp\"\n"}};
  EXPECT_EQ(thirdPartiesInPublicHeaders(sources), Faults{});
}

TEST(HouseRules, AThirdPartyInAForeignFolderIsFound) {
  const Sources sources{{"collision/hull.cpp", "#include <gmpxx.h>\n"},
                        {"scene/import.cpp", "#include <gmpxx.h>\n"},
                        {"scene/log.cpp", "#include <spdlog/spdlog.h>\n"},
                        {"collision/tree.cpp", "#include <boost/geometry.hpp>\n"},
                        {"server/listen.cpp", "#include <boost/asio.hpp>\n"}};
  EXPECT_EQ(thirdPartiesOutOfPlace(sources).size(), 3U);
}

TEST(HouseRules, SmallFaultsAreFound) {
  const std::string word = std::string("TO") + "DO";
  const Sources sources{{"a.hpp", "int a;\n// " + word + ": more\nint b;\n"},
                        {"b.md", "see [the code](a.hpp) and [nothing](c.hpp#top)\n"}};
  EXPECT_EQ(headersWithoutPragmaOnce(sources), Faults{"a.hpp: no #pragma once"});
  EXPECT_EQ(longFiles(sources, 2), Faults{"a.hpp: 3 lines"});
  EXPECT_EQ(unfinishedWork(sources), Faults{"a.hpp:2: // " + word + ": more"});
  EXPECT_EQ(brokenLinks(sources), Faults{"b.md:1: links to c.hpp, which is not there"});
}

}  // namespace
}  // namespace enfilade::house
