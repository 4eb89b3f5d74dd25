// All of the shared cases, at both levels: what must hold, holds.
#include <gtest/gtest.h>

#include "collision/shapes/hull.hpp"
#include "tests/accuracy/case_score.hpp"
#include "tests/accuracy/mesh_brute_force.hpp"
#include "tests/support/shared_folder.hpp"

namespace enfilade::accuracy {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> caseFiles(const fs::path& folder) {
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
  for (const fs::path& file : caseFiles(folder)) {
    std::map<long, Warmth> sequences;
    for (const Case& asked : readCases(file)) {
      Warmth cold;
      Warmth& warmth = asked.sequence ? sequences[*asked.sequence] : cold;
      addToScore(asked, answerCase(asked, meshes, level, warmth), level, meshes,
                 scores[asked.family]);
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
  for (const Case& asked : readCases(*shared / "cases" / "mesh_cases.jsonl")) {
    Warmth cold;
    const Answer answer = answerCase(asked, meshes, Level::refine, cold);
    const collision::Hull hull = collision::buildHull(asked.a.points);
    const collision::ConvexBody body{hull.vertices, asked.a.translation, &asked.a.rotation, &hull};
    const MeshContact twin = bruteForceContact(body, meshes.at(asked.mesh), true);
    EXPECT_EQ(answer.verdict, twin.verdict) << asked.id;
    EXPECT_EQ(answer.penetrated, twin.penetrated) << asked.id;
    EXPECT_EQ(answer.touched, twin.touched) << asked.id;
    EXPECT_EQ(answer.distance, twin.distance) << asked.id;
    contacts += twin.verdict == collision::Verdict::separated ? 0 : 1;
  }
  EXPECT_GT(contacts, 20);
  EXPECT_LT(contacts, 58);
}

}  // namespace
}  // namespace enfilade::accuracy
