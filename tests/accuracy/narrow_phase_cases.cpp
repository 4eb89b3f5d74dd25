// narrow_phase_cases [--level decide|refine] [--meshes meshes.jsonl] [--score] FILE.jsonl...
// Writes the answer to each case as one JSON line to stdout. With --score, writes a table by family
// instead and the faults to stderr. Exit codes: 0 done, 1 a file cannot be read, 2 usage, 3 --score
// found a violated requirement.
#include <cstring>
#include <filesystem>
#include <iostream>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/accuracy/case_score.hpp"

namespace {

using namespace enfilade::accuracy;

struct Options {
  Level level = Level::refine;
  bool score = false;
  std::vector<std::string> meshes, files;
};

/// Throws std::invalid_argument.
Options parse(int count, char** arguments) {
  Options options;
  for (int i = 1; i < count; ++i) {
    const std::string argument = arguments[i];
    const auto value = [&]() -> std::string {
      if (i + 1 >= count) throw std::invalid_argument(argument + " needs a value");
      return arguments[++i];
    };
    if (argument == "--score") {
      options.score = true;
    } else if (argument == "--meshes") {
      options.meshes.push_back(value());
    } else if (argument == "--level") {
      const std::string level = value();
      if (level != "decide" && level != "refine")
        throw std::invalid_argument("--level must be decide or refine, not " + level);
      options.level = level == "decide" ? Level::decide : Level::refine;
    } else if (argument.rfind("--", 0) == 0) {
      throw std::invalid_argument("unknown option " + argument);
    } else {
      options.files.push_back(argument);
    }
  }
  if (options.files.empty()) throw std::invalid_argument("no case file given");
  return options;
}

int run(const Options& options) {
  Meshes meshes;
  for (const std::string& file : options.meshes) meshes.merge(readMeshes(file));
  std::map<std::string, Score> scores;
  for (const std::string& file : options.files) {
    if (std::filesystem::is_directory(file))
      throw std::runtime_error(file + ": is a folder; name its case files");
    std::map<long, WarmStart> sequences;
    const auto cases = readCases(file);
    if (cases.empty()) throw std::runtime_error(file + ": contains no cases");
    for (const Case& testCase : cases) {
      WarmStart cold;
      WarmStart& warmth = testCase.sequence ? sequences[*testCase.sequence] : cold;
      const Answer answer = answerCase(testCase, meshes, options.level, warmth);
      if (options.score)
        addToScore(testCase, answer, options.level, meshes, scores[testCase.family]);
      else
        std::cout << formatJsonLine(testCase, answer) << '\n';
    }
  }
  if (!options.score) return 0;
  printScores(scores, std::cout);
  int code = 0;
  for (const auto& [family, score] : scores) {
    if (!holds(score)) code = 3;
    for (const std::string& fault : score.faults) std::cerr << family << ' ' << fault << '\n';
  }
  return code;
}

}  // namespace

int main(int count, char** arguments) {
  try {
    return run(parse(count, arguments));
  } catch (const std::invalid_argument& error) {
    std::cerr << "narrow_phase_cases: " << error.what()
              << "\nusage: narrow_phase_cases [--level decide|refine] [--meshes meshes.jsonl] "
                 "[--score] FILE.jsonl...\n";
    return 2;
  } catch (const std::exception& error) {
    std::cerr << "narrow_phase_cases: " << error.what() << '\n';
    return 1;
  }
}
