#include "tests/accuracy/case_score.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ostream>

namespace enfilade::accuracy {
namespace {

using collision::Certificate;
using collision::Verdict;

void addFault(const Case& testCase, const char* what, int& counter, Score& score) {
  ++counter;
  score.faults.push_back(testCase.id + ": " + what);
}

const char* getVerdictName(Verdict verdict) {
  if (verdict == Verdict::separated) return "separated";
  return verdict == Verdict::touching ? "touching" : "penetrating";
}

/// |value - truth| / |truth|.
double computeRelativeError(double value, const mpf_class& truth) {
  return mpf_class(abs(toPreciseNumber(value) - truth) / abs(truth)).get_d();
}

double computeDiagonal(const std::vector<Vec3>& points) {
  collision::Aabb box;
  for (const Vec3& p : points) box.include(p);
  return points.empty() ? 0 : box.size().norm();
}

/// The larger bounding-box diagonal of the local lists, or the distance.
double computeScale(const Case& testCase, const mpf_class& distance) {
  return std::max(
      {computeDiagonal(testCase.a.points), computeDiagonal(testCase.b.points), distance.get_d()});
}

/// Largest |coordinate| of rotation * vertex + shift.
double computeMaxCoordinate(const Placed& body, const Vec3& shift) {
  double reach = 0;
  for (const Vec3& p : body.points)
    reach = std::max(reach, (body.rotation * p + shift).cwiseAbs().maxCoeff());
  return reach;
}

double computeUlp(double value) {
  return std::nextafter(value, std::numeric_limits<double>::infinity()) - value;
}

bool isPenetrating(const Case& testCase) {
  return testCase.truth.verdict == "penetrating";
}
bool isSeparated(const Case& testCase) {
  return testCase.truth.verdict == "separated";
}

void scoreVerdict(const Case& testCase, const Answer& answer, Score& score) {
  if (testCase.truth.verdict == getVerdictName(answer.verdict)) return;
  addFault(testCase, "verdict", score.wrong, score);
  const std::string& text =
      isPenetrating(testCase) ? testCase.truth.penetration : testCase.truth.distance;
  if (text.empty()) return;
  const mpf_class amount = toPreciseNumber(text);
  const mpf_class limit(1e-9 *
                        computeScale(testCase, isSeparated(testCase) ? amount : mpf_class(0)));
  if (amount > limit) ++score.wrongBeyond;
}

/// |value - truth| <= bound, exactly.
bool isWithin(double value, const mpf_class& truth, double bound) {
  return mpf_class(abs(toPreciseNumber(value) - truth)) <= toPreciseNumber(bound);
}

void scoreDistance(const Case& testCase, const Answer& answer, Level level, Score& score) {
  if (!isSeparated(testCase) || answer.verdict != Verdict::separated) return;
  const mpf_class truth = toPreciseNumber(testCase.truth.distance);
  const double error = computeRelativeError(answer.distance, truth);
  score.distanceErrors.push_back(error);
  if (level == Level::refine) {
    if (!(error <= kDistanceError)) addFault(testCase, "distance", score.outsideBound, score);
    return;
  }
  if (!isWithin(answer.distance, truth, answer.errorBound))
    addFault(testCase, "distance outside its bound", score.outsideBound, score);
  if (!testCase.mesh.empty()) return;
  const Vec3 shift = testCase.b.translation - testCase.a.translation;
  const double reach = std::max(computeMaxCoordinate(testCase.a, Vec3::Zero()),
                                computeMaxCoordinate(testCase.b, shift));
  if (!(answer.errorBound <= kBoundUnits * 0x1p-53 * reach))
    addFault(testCase, "error bound too wide", score.boundTooWide, score);
}

void scoreDepth(const Case& testCase, const Answer& answer, Level level, Score& score) {
  if (!isPenetrating(testCase) || answer.verdict != Verdict::penetrating || !testCase.mesh.empty())
    return;
  if (!answer.penetration) {
    ++score.noDepth;
    return;
  }
  if (!answer.depthIsGlobal) ++score.upperBounds;
  const mpf_class truth = toPreciseNumber(testCase.truth.penetration);
  const double error = computeRelativeError(*answer.penetration, truth);
  score.depthErrors.push_back(error);
  if (level == Level::refine) {
    if (!(error <= kDepthError)) addFault(testCase, "depth", score.outsideBound, score);
    return;
  }
  const bool inside = answer.depthIsGlobal
                          ? isWithin(*answer.penetration, truth, answer.errorBound)
                          : toPreciseNumber(*answer.penetration) + answer.errorBound >= truth;
  if (!inside) addFault(testCase, "depth outside its bound", score.outsideBound, score);
}

bool isFinite(const Vec3& v) {
  return v.allFinite();
}

/// Each point within a few ulps of its body, and as far apart as the bodies are.
bool areWitnessesValid(const Case& testCase, const Placed& b, const Answer& answer) {
  if (!isFinite(answer.pointA) || !isFinite(answer.pointB)) return false;
  const ExactPair pair = makeExactPair(testCase.a, b, answer.pointA, answer.pointB);
  const double reach = std::max(computeMaxCoordinate(testCase.a, testCase.a.translation),
                                computeMaxCoordinate(b, b.translation));
  const double tolerance = kWitnessUlps * computeUlp(reach);
  if (!isWithinTolerance(pair.pointA, pair.a, pair.bits, tolerance)) return false;
  if (!isWithinTolerance(pair.pointB, pair.b, pair.bits, tolerance)) return false;
  const mpf_class distance = computeDistance(answer.pointA, answer.pointB);
  const mpf_class truth = toPreciseNumber(isSeparated(testCase) ? testCase.truth.distance : "0");
  return mpf_class(abs(distance - truth)) <= toPreciseNumber(2 * tolerance);
}

void scoreWitnesses(const Case& testCase, const Answer& answer, const Meshes& meshes,
                    Score& score) {
  if (testCase.truth.verdict != getVerdictName(answer.verdict)) return;
  Placed b = testCase.b;
  if (!testCase.mesh.empty()) {
    if (!answer.nearestTriangle) return;
    const Triangle& triangle = meshes.at(testCase.mesh).at(*answer.nearestTriangle);
    b.points.assign(triangle.begin(), triangle.end());
  }
  if (!areWitnessesValid(testCase, b, answer))
    addFault(testCase, "witness points", score.witnessOff, score);
}

void scoreMesh(const Case& testCase, const Answer& answer, Score& score) {
  if (testCase.mesh.empty()) return;
  if (answer.penetrated != testCase.truth.penetrated || answer.touched != testCase.truth.touched)
    addFault(testCase, "lists of triangles", score.listsWrong, score);
}

void scoreTime(const Case& testCase, const Answer& answer, Score& score) {
  if (!testCase.course || testCase.truth.tc.empty()) return;
  const auto& truth = testCase.truth.toi;
  const mpf_class tc = toPreciseNumber(testCase.truth.tc);
  bool right = answer.tc && toPreciseNumber(*answer.tc) <= tc &&
               computeRelativeError(*answer.tc, tc) < 1e-14;
  right = right && answer.toi.has_value() == truth.has_value();
  if (right && truth) {
    const auto [lo, hi] = *answer.toi;
    right = lo <= (*truth)[1] && hi >= (*truth)[0] && hi - lo <= kTimeWidth * (1 + hi) &&
            *answer.tc <= (*truth)[1];
  }
  if (!right) addFault(testCase, "time of impact", score.timeWrong, score);
}

bool isUsable(const Answer& answer) {
  return answer.error.empty() && std::isfinite(answer.distance) &&
         std::isfinite(answer.penetration.value_or(0)) && isFinite(answer.pointA) &&
         isFinite(answer.pointB);
}

/// The quantile at fraction `part`; 0 for an empty list.
double computeQuantile(std::vector<double> list, double part) {
  if (list.empty()) return 0;
  std::sort(list.begin(), list.end());
  const auto index = static_cast<std::size_t>(part * static_cast<double>(list.size() - 1) + 0.5);
  return list[index];
}

Score sumScores(const std::map<std::string, Score>& scores) {
  Score sum;
  for (const auto& [family, s] : scores) {
    for (int Score::*field :
         {&Score::count, &Score::noAnswer, &Score::wrong, &Score::wrongBeyond, &Score::nearWrong,
          &Score::outsideBound, &Score::boundTooWide, &Score::witnessOff, &Score::listsWrong,
          &Score::timeWrong, &Score::noDepth, &Score::upperBounds, &Score::filter,
          &Score::expansion, &Score::rational})
      sum.*field += s.*field;
    for (auto Score::*list : {&Score::distanceErrors, &Score::depthErrors, &Score::nanoseconds})
      (sum.*list).insert((sum.*list).end(), (s.*list).begin(), (s.*list).end());
  }
  return sum;
}

void printRow(const std::string& family, const Score& s, std::ostream& out) {
  char line[400];
  const double all = std::max(1, s.count) / 100.0;
  std::snprintf(line, sizeof line,
                "| %-21s | %5d | %3d | %4d %4d | %4d | %7.1e %7.1e %7.1e | %7.1e %7.1e %7.1e | "
                "%4d %4d %4d %4d | %4d | %4d | %4d | %5.1f %5.1f %5.1f | %8.0f |\n",
                family.c_str(), s.count, s.noAnswer, s.wrong, s.wrongBeyond, s.nearWrong,
                computeQuantile(s.distanceErrors, 0.5), computeQuantile(s.distanceErrors, 0.99),
                computeQuantile(s.distanceErrors, 1), computeQuantile(s.depthErrors, 0.5),
                computeQuantile(s.depthErrors, 0.99), computeQuantile(s.depthErrors, 1),
                s.outsideBound, s.boundTooWide, s.upperBounds, s.noDepth, s.witnessOff,
                s.listsWrong, s.timeWrong, s.filter / all, s.expansion / all, s.rational / all,
                computeQuantile(s.nanoseconds, 0.5));
  out << line;
}

}  // namespace

void addToScore(const Case& testCase, const Answer& answer, Level level, const Meshes& meshes,
                Score& score) {
  ++score.count;
  if (!isUsable(answer)) {
    addFault(testCase, "no answer", score.noAnswer, score);
    return;
  }
  scoreVerdict(testCase, answer, score);
  if (testCase.truth.near && answer.near != testCase.truth.near)
    addFault(testCase, "near", score.nearWrong, score);
  scoreDistance(testCase, answer, level, score);
  scoreDepth(testCase, answer, level, score);
  scoreWitnesses(testCase, answer, meshes, score);
  scoreMesh(testCase, answer, score);
  scoreTime(testCase, answer, score);
  ++(answer.certificate == Certificate::filter      ? score.filter
     : answer.certificate == Certificate::expansion ? score.expansion
                                                    : score.rational);
  score.nanoseconds.push_back(answer.nanoseconds);
}

bool holds(const Score& score) {
  return score.faults.empty();
}

void printScores(const std::map<std::string, Score>& scores, std::ostream& out) {
  out << "| family                | count | no  | wrong >1e-9s | near | distance error 50 %, 99 %, "
         "max | depth error 50 %, 99 %, max | out of bound, too wide, upper, no depth | witness | "
         "lists | time | % filter, expansion, rational | ns |\n|"
      << std::string(13, '-') << "|\n";
  for (const auto& [family, score] : scores) printRow(family, score, out);
  printRow("all", sumScores(scores), out);
}

}  // namespace enfilade::accuracy
