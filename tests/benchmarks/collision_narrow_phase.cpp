// Benchmark of all narrow phases: time of a query, its error and its wrong verdicts.
//
//   collision_narrow_phase [--quick] [--out FILE] [--only PART_OF_A_NAME]
//
// First polytopes of 8 to 200 vertices in coherent motion (convex_motions.hpp), cold and warm,
// methods in turns; errors are relative to our `refine` level. Then the families of exact cases, if
// the shared folder exists; errors are relative to the truth in the files, also for `refine`.
// Methods run in child processes, because some peers abort.

#include <cstdlib>

#include "tests/accuracy/case_file.hpp"
#include "tests/benchmarks/answer_errors.hpp"
#include "tests/benchmarks/convex_motions.hpp"
#include "tests/benchmarks/guarded_run.hpp"
#include "tests/support/shared_folder.hpp"

namespace {

using namespace enfilade::benchmarks;
namespace accuracy = enfilade::accuracy;
using Methods = std::vector<NarrowPhaseMethod>;

constexpr unsigned kMaxSeconds = 60;  // a child that needs more for one turn is hanging

constexpr unsigned kMaxSecondsPerCase = 5;

struct Effort {
  std::size_t pairs, steps, turns;
  double secondsATurn;    ///< slow methods make fewer steps, at least kMinSteps a pair
  double secondsAnswers;  ///< and give fewer answers
  int repeats;            ///< of a cold case
};

nlohmann::json makeHead(const NarrowPhaseMethod& method, const char* bench) {
  return {
      {"bench", bench}, {"method", method.name}, {"ours", method.ours}, {"level", method.level}};
}

// ---- coherent motion ---------------------------------------------------------------------------

constexpr std::size_t kMaxPairs = 16;
constexpr std::size_t kMinSteps = 3;

/// Nanoseconds a query, by pair, in one turn of a method.
struct Turn {
  std::array<double, kMaxPairs> cold{}, warm{};
};

double measureNanoseconds(PairOfBodies& pair, const ConvexMotion& motion, std::size_t steps,
                          bool warm) {
  pair.forget();
  const auto start = Clock::now();
  for (std::size_t k = 0; k < steps; ++k) {
    if (!warm) pair.forget();
    pair.ask(motion.placesA[k], motion.placesB[k]);
  }
  return 1e9 * measureSecondsSince(start) / static_cast<double>(steps);
}

Turn measureTurn(const NarrowPhaseMethod& method, const std::vector<ConvexMotion>& motions,
                 double seconds) {
  Turn turn;
  const auto start = Clock::now();
  const double secondsAPair = seconds / static_cast<double>(motions.size());
  for (std::size_t k = 0; k < motions.size() && (k == 0 || measureSecondsSince(start) < seconds);
       ++k) {
    const auto pair = method.make(motions[k].a, motions[k].b);
    // Warms the machine's caches, and measures how many steps the time allows.
    const double one = 1e-9 * measureNanoseconds(*pair, motions[k], 1, true);
    if (one > secondsAPair) {  // one step already used the available time
      turn.cold[k] = turn.warm[k] = 1e9 * one;
      continue;
    }
    const auto steps = static_cast<std::size_t>(
        std::clamp(secondsAPair / (2 * one), static_cast<double>(kMinSteps),
                   static_cast<double>(motions[k].placesA.size())));
    turn.cold[k] = measureNanoseconds(*pair, motions[k], steps, false);
    turn.warm[k] = method.warm ? measureNanoseconds(*pair, motions[k], steps, true) : turn.cold[k];
  }
  return turn;
}

struct GuardedAnswer {
  Answer answer;
  bool asked = true;  ///< false: the method ran out of time
};

/// One answer for each step of each motion, warm.
std::vector<GuardedAnswer> collectAnswers(const NarrowPhaseMethod& method,
                                          const std::vector<ConvexMotion>& motions,
                                          double seconds) {
  const std::size_t steps = motions.front().placesA.size();
  const double secondsAPair = seconds / static_cast<double>(motions.size());
  std::unique_ptr<PairOfBodies> pair;
  auto start = Clock::now();
  return computeGuarded<GuardedAnswer>(steps * motions.size(), kMaxSeconds, [&](std::size_t k) {
    const ConvexMotion& motion = motions[k / steps];
    if (!pair || k % steps == 0) {
      pair = method.make(motion.a, motion.b);
      start = Clock::now();
    }
    if (measureSecondsSince(start) > secondsAPair) return GuardedAnswer{{}, false};
    return GuardedAnswer{pair->ask(motion.placesA[k % steps], motion.placesB[k % steps]), true};
  });
}

/// Our two levels are the reference: the exact verdict of decide and the numbers of refine. Without
/// time for refine the depth is unknown.
std::vector<std::optional<TrueAnswer>> findTruth(const Methods& methods,
                                                 const std::vector<ConvexMotion>& motions,
                                                 double seconds) {
  std::vector<std::optional<TrueAnswer>> truth(motions.size() * motions.front().placesA.size());
  for (const NarrowPhaseMethod& method : methods) {
    if (!method.ours) continue;
    const auto answers = collectAnswers(method, motions, seconds);
    for (std::size_t k = 0; k < answers.size(); ++k) {
      const Answer& answer = answers[k].answer;
      if (!answers[k].asked || answer.verdict == Answer::Verdict::none) continue;
      const bool collides = answer.verdict == Answer::Verdict::collides;
      const bool exactDepth = method.level == "refine" && collides;
      truth[k] =
          TrueAnswer{collides, collides ? 0 : answer.distance, exactDepth ? answer.depth : 0, 2};
    }
  }
  return truth;
}

void report(const NarrowPhaseMethod& method, std::size_t vertices, Gap gap, const Errors& errors,
            const std::vector<double>& cold, const std::vector<double>& warm, Results& results) {
  const double coldMedian = computeQuantile(cold, 0.5);
  const double warmMedian = computeQuantile(warm, 0.5);
  std::printf(
      "%-26s %4zu %-11s | cold %10.0f  warm %10.0f ns | wrong %4zu none %4zu of %5zu |"
      " error of distance %8.1e of depth %8.1e\n",
      method.name.c_str(), vertices, getName(gap), coldMedian, warmMedian, errors.wrong,
      errors.none, errors.count, computeQuantile(errors.distance, 1),
      computeQuantile(errors.depth, 1));
  std::fflush(stdout);
  auto line = makeHead(method, "narrow");
  line.update(errors.toJson());
  line.update({{"vertices", vertices},
               {"gap", getName(gap)},
               {"warms", method.warm},
               {"cold_ns", toJsonNumber(coldMedian)},
               {"warm_ns", toJsonNumber(warmMedian)}});
  results.add(line);
}

void measureMotion(const Methods& methods, std::size_t vertices, Gap gap, const Effort& effort,
                   Results& results) {
  const auto motions = makeConvexMotions(vertices, gap, effort.pairs, effort.steps);
  const auto truth = findTruth(methods, motions, effort.secondsAnswers);
  const auto turns =
      computeGuarded<Turn>(effort.turns * methods.size(), kMaxSeconds, [&](std::size_t k) {
        return measureTurn(methods[k % methods.size()], motions, effort.secondsATurn);
      });
  for (std::size_t m = 0; m < methods.size(); ++m) {
    Errors errors;
    const auto answers = collectAnswers(methods[m], motions, effort.secondsAnswers);
    for (std::size_t k = 0; k < answers.size(); ++k) {
      if (answers[k].asked && truth[k]) errors.add(answers[k].answer, *truth[k]);
    }
    std::vector<double> cold, warm;
    for (std::size_t k = m; k < turns.size(); k += methods.size()) {
      for (std::size_t pair = 0; pair < kMaxPairs && turns[k].cold[pair] > 0; ++pair) {
        cold.push_back(turns[k].cold[pair]);
        warm.push_back(turns[k].warm[pair]);
      }
    }
    report(methods[m], vertices, gap, errors, cold, warm, results);
  }
}

// ---- families of exact cases -------------------------------------------------------------------

struct TimedAnswer {
  Answer answer;
  double nanoseconds = 0;
};

RigidTransform getPlacement(const accuracy::Placed& body) {
  return {body.rotation, body.translation};
}

double computeDiagonal(const Points& points) {
  enfilade::collision::Aabb box;
  for (const Vec3& p : points) box.include(p);
  return box.size().norm();
}

TrueAnswer findTruth(const accuracy::Case& asked) {
  const auto parsed = [](const std::string& s) {
    return s.empty() ? 0.0L : std::strtold(s.c_str(), nullptr);
  };
  TrueAnswer truth{asked.truth.verdict != "separated", parsed(asked.truth.distance),
                   parsed(asked.truth.penetration), 0};
  truth.scale = std::max({computeDiagonal(asked.a.points), computeDiagonal(asked.b.points),
                          static_cast<double>(truth.distance)});
  return truth;
}

/// Answers cases in order: steps of one sequence warm, all others cold.
class CaseAnswerer {
 public:
  CaseAnswerer(const NarrowPhaseMethod& method, int repeats) : method_(method), repeats_(repeats) {}

  TimedAnswer answer(const accuracy::Case& asked) {
    const bool continuesSequence = asked.sequence && sequence_ == asked.sequence &&
                                   asked.a.points == pointsA_ && asked.b.points == pointsB_;
    if (!continuesSequence) {
      pair_ = method_.make(asked.a.points, asked.b.points);
      sequence_ = asked.sequence;
      pointsA_ = asked.a.points;
      pointsB_ = asked.b.points;
    }
    return continuesSequence ? ask(asked) : askCold(asked);
  }

 private:
  TimedAnswer ask(const accuracy::Case& asked) {
    const RigidTransform a = getPlacement(asked.a);
    const RigidTransform b = getPlacement(asked.b);
    const auto start = Clock::now();
    const Answer answer = pair_->ask(a, b);
    return {answer, 1e9 * measureSecondsSince(start)};
  }
  TimedAnswer askCold(const accuracy::Case& asked) {
    std::vector<double> times;
    TimedAnswer timed;
    for (int k = 0; k < repeats_; ++k) {
      pair_->forget();
      timed = ask(asked);
      times.push_back(timed.nanoseconds);
    }
    timed.nanoseconds = computeQuantile(times, 0.5);
    return timed;
  }

  const NarrowPhaseMethod& method_;
  int repeats_;
  std::unique_ptr<PairOfBodies> pair_;
  std::optional<long> sequence_;
  Points pointsA_, pointsB_;
};

std::vector<accuracy::Case> readPairCases(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string name = entry.path().filename();
    if (entry.path().extension() == ".jsonl" && name.find("mesh") == std::string::npos) {
      files.push_back(entry.path());
    }
  }
  std::sort(files.begin(), files.end());
  std::vector<accuracy::Case> cases;
  for (const auto& file : files) {
    for (accuracy::Case& asked : accuracy::readCases(file)) cases.push_back(std::move(asked));
  }
  return cases;
}

void measureCases(const NarrowPhaseMethod& method, const std::vector<accuracy::Case>& cases,
                  const Effort& effort, Results& results) {
  CaseAnswerer answerer(method, effort.repeats);
  const auto answers = computeGuarded<TimedAnswer>(
      cases.size(), kMaxSecondsPerCase, [&](std::size_t k) { return answerer.answer(cases[k]); });
  std::map<std::string, Errors> errors;
  std::map<std::string, std::vector<double>> times;
  for (std::size_t k = 0; k < cases.size(); ++k) {
    for (const std::string& family : {cases[k].family, std::string("all")}) {
      errors[family].add(answers[k].answer, findTruth(cases[k]));
      if (answers[k].nanoseconds > 0) times[family].push_back(answers[k].nanoseconds);
    }
  }
  for (const auto& [family, e] : errors) {
    auto line = makeHead(method, "family");
    line.update(e.toJson());
    line.update({{"family", family},
                 {"ns", toJsonNumber(computeQuantile(times[family], 0.5))},
                 {"ns_99", toJsonNumber(computeQuantile(times[family], 0.99))}});
    results.add(line);
    if (family != "all") continue;
    std::printf(
        "%-26s all cases | %8.0f ns | wrong %4zu (%zu beyond 1e-9) none %4zu of %5zu |"
        " error of distance 99 %% %8.1e most %8.1e, of depth most %8.1e |"
        " filter %zu expansion %zu rational %zu\n",
        method.name.c_str(), computeQuantile(times[family], 0.5), e.wrong, e.wrongBeyond, e.none,
        e.count, computeQuantile(e.distance, 0.99), computeQuantile(e.distance, 1),
        computeQuantile(e.depth, 1), e.filter, e.expansion, e.rational);
    std::fflush(stdout);
  }
}

}  // namespace

int main(int argc, char** argv) {
  const Arguments arguments(argc, argv);
  const Effort effort =
      arguments.quick ? Effort{4, 100, 3, 0.02, 0.1, 1} : Effort{16, 200, 5, 0.15, 1, 3};
  Results results(arguments);
  Methods methods = makeNarrowPhaseMethods();
  std::erase_if(methods, [&](const auto& m) { return !arguments.wants(m.name); });
  for (const std::size_t vertices : {8u, 20u, 50u, 200u}) {
    for (const Gap gap : kGaps) measureMotion(methods, vertices, gap, effort, results);
  }
  const auto shared = enfilade::tests::findSharedFolder();
  if (!shared || !std::filesystem::is_directory(*shared / "cases")) {
    std::printf("no shared cases: set ENFILADE_SHARED or put the folder next to the sources\n");
    return 0;
  }
  const auto cases = readPairCases(*shared / "cases");
  for (const auto& method : methods) measureCases(method, cases, effort, results);
}
