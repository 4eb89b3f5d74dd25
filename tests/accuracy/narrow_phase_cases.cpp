// narrow_phase_cases [--level decide|refine] [--meshes meshes.jsonl] [--score] FILE.jsonl...
// Answers each case of the files with one JSON line on stdout; with --score, a table by family
// against the truth in the files instead, and what is wrong on stderr. Exit codes: 0 done, 1 a file
// cannot be read, 2 usage, 3 --score found something that must hold and does not.
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
      if (i + 1 >= count) throw std::invalid_argument(argument + " wants a value");
      return arguments[++i];
    };
    if (argument == "--score") {
      options.score = true;
    } else if (argument == "--meshes") {
      options.meshes.push_back(value());
    } else if (argument == "--level") {
      const std::string level = value();
      if (level != "decide" && level != "refine")
        throw std::invalid_argument("--level is decide or refine, not " + level);
      options.level = level == "decide" ? Level::decide : Level::refine;
    } else if (argument.rfind("--", 0) == 0) {
      throw std::invalid_argument("unknown option " + argument);
    } else {
      options.files.push_back(argument);
    }
  }
  if (options.files.empty()) throw std::invalid_argument("no file of cases is named");
  return options;
}

int run(const Options& options) {
  Meshes meshes;
  for (const std::string& file : options.meshes) meshes.merge(readMeshes(file));
  std::map<std::string, Score> scores;
  for (const std::string& file : options.files) {
    if (std::filesystem::is_directory(file))
      throw std::runtime_error(file + ": is a folder; name its files of cases");
    std::map<long, Warmth> sequences;
    const auto cases = readCases(file);
    if (cases.empty()) throw std::runtime_error(file + ": holds no cases");
    for (const Case& asked : cases) {
      Warmth cold;
      Warmth& warmth = asked.sequence ? sequences[*asked.sequence] : cold;
      const Answer answer = answerCase(asked, meshes, options.level, warmth);
      if (options.score)
        addToScore(asked, answer, options.level, meshes, scores[asked.family]);
      else
        std::cout << jsonLine(asked, answer) << '\n';
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
