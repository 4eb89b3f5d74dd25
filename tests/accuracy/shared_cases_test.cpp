// Tests all shared cases at both levels.
#include <gtest/gtest.h>

#include "collision/shapes/hull.hpp"
#include "tests/accuracy/case_score.hpp"
#include "tests/accuracy/mesh_brute_force.hpp"
#include "tests/support/shared_folder.hpp"

namespace enfilade::accuracy {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> listCaseFiles(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.path().extension() == ".jsonl" && entry.path().filename() != "meshes.jsonl")
      files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

int scoreAll(const fs::path& folder, Level level, std::map<std::string, Score>& scores) {
  const Meshes meshes = readMeshes(folder / "meshes.jsonl");
  int count = 0;
  for (const fs::path& file : listCaseFiles(folder)) {
    std::map<long, WarmStart> sequences;
    for (const Case& testCase : readCases(file)) {
      WarmStart cold;
      WarmStart& warmth = testCase.sequence ? sequences[*testCase.sequence] : cold;
      addToScore(testCase, answerCase(testCase, meshes, level, warmth), level, meshes,
                 scores[testCase.family]);
      ++count;
    }
  }
  return count;
}

void expectAllHolds(Level level) {
  ENFILADE_NEED_SHARED(shared);
  std::map<std::string, Score> scores;
  EXPECT_GT(scoreAll(*shared / "cases", level, scores), 4000);
  for (const auto& [family, score] : scores)
    for (const std::string& fault : score.faults) ADD_FAILURE() << family << ' ' << fault;
}

TEST(SharedCases, AllHoldAtDecide) {
  expectAllHolds(Level::decide);
}

TEST(SharedCases, AllHoldAtRefine) {
  expectAllHolds(Level::refine);
}

TEST(SharedCases, MeshQueriesAnswerAsTheTrianglesOneByOne) {
  ENFILADE_NEED_SHARED(shared);
  const Meshes meshes = readMeshes(*shared / "cases" / "meshes.jsonl");
  int contacts = 0;
  for (const Case& testCase : readCases(*shared / "cases" / "mesh_cases.jsonl")) {
    WarmStart cold;
    const Answer answer = answerCase(testCase, meshes, Level::refine, cold);
    const collision::Hull hull = collision::buildHull(testCase.a.points);
    const collision::PlacedConvex body{hull.vertices, testCase.a.translation, &testCase.a.rotation,
                                       &hull};
    const MeshContact reference = findContactByBruteForce(body, meshes.at(testCase.mesh), true);
    EXPECT_EQ(answer.verdict, reference.verdict) << testCase.id;
    EXPECT_EQ(answer.penetrated, reference.penetrated) << testCase.id;
    EXPECT_EQ(answer.touched, reference.touched) << testCase.id;
    EXPECT_EQ(answer.distance, reference.distance) << testCase.id;
    contacts += reference.verdict == collision::Verdict::separated ? 0 : 1;
  }
  EXPECT_GT(contacts, 20);
  EXPECT_LT(contacts, 58);
}

}  // namespace
}  // namespace enfilade::accuracy
