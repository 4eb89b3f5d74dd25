#include "tests/accuracy/case_score.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ostream>

namespace enfilade::accuracy {
namespace {

using collision::DecidedBy;
using collision::Verdict;

void blame(const Case& asked, const char* what, int& counter, Score& score) {
  ++counter;
  score.faults.push_back(asked.id + ": " + what);
}

const char* nameOf(Verdict verdict) {
  if (verdict == Verdict::separated) return "separated";
  return verdict == Verdict::touching ? "touching" : "penetrating";
}

/// As an error: distance from the truth, of the truth.
double relativeError(double value, const mpf_class& truth) {
  return mpf_class(abs(preciseNumber(value) - truth) / abs(truth)).get_d();
}

double diagonal(const std::vector<Vec3>& points) {
  collision::Box box;
  for (const Vec3& p : points) box.include(p);
  return points.empty() ? 0 : box.size().norm();
}

/// The larger bounding-box diagonal of the local lists, or the distance.
double scaleOf(const Case& asked, const mpf_class& distance) {
  return std::max({diagonal(asked.a.points), diagonal(asked.b.points), distance.get_d()});
}

/// Largest |coordinate| of rotation * vertex + shift.
double reachOf(const Placed& body, const Vec3& shift) {
  double reach = 0;
  for (const Vec3& p : body.points)
    reach = std::max(reach, (body.rotation * p + shift).cwiseAbs().maxCoeff());
  return reach;
}

double ulpOf(double value) {
  return std::nextafter(value, std::numeric_limits<double>::infinity()) - value;
}

bool isPenetrating(const Case& asked) {
  return asked.truth.verdict == "penetrating";
}
bool isSeparated(const Case& asked) {
  return asked.truth.verdict == "separated";
}

void scoreVerdict(const Case& asked, const Answer& answer, Score& score) {
  if (asked.truth.verdict == nameOf(answer.verdict)) return;
  blame(asked, "verdict", score.wrong, score);
  const std::string& text = isPenetrating(asked) ? asked.truth.penetration : asked.truth.distance;
  if (text.empty()) return;
  const mpf_class amount = preciseNumber(text);
  const mpf_class limit(1e-9 * scaleOf(asked, isSeparated(asked) ? amount : mpf_class(0)));
  if (amount > limit) ++score.wrongBeyond;
}

/// |value - truth| <= bound, exactly.
bool within(double value, const mpf_class& truth, double bound) {
  return mpf_class(abs(preciseNumber(value) - truth)) <= preciseNumber(bound);
}

void scoreDistance(const Case& asked, const Answer& answer, Level level, Score& score) {
  if (!isSeparated(asked) || answer.verdict != Verdict::separated) return;
  const mpf_class truth = preciseNumber(asked.truth.distance);
  const double error = relativeError(answer.distance, truth);
  score.distanceErrors.push_back(error);
  if (level == Level::refine) {
    if (!(error <= kDistanceError)) blame(asked, "distance", score.outsideBound, score);
    return;
  }
  if (!within(answer.distance, truth, answer.errorBound))
    blame(asked, "distance outside its bound", score.outsideBound, score);
  if (!asked.mesh.empty()) return;
  const Vec3 shift = asked.b.translation - asked.a.translation;
  const double reach = std::max(reachOf(asked.a, Vec3::Zero()), reachOf(asked.b, shift));
  if (!(answer.errorBound <= kBoundUnits * 0x1p-53 * reach))
    blame(asked, "error bound too wide", score.boundTooWide, score);
}

void scoreDepth(const Case& asked, const Answer& answer, Level level, Score& score) {
  if (!isPenetrating(asked) || answer.verdict != Verdict::penetrating || !asked.mesh.empty())
    return;
  if (!answer.penetration) {
    ++score.noDepth;
    return;
  }
  if (!answer.depthIsGlobal) ++score.upperBounds;
  const mpf_class truth = preciseNumber(asked.truth.penetration);
  const double error = relativeError(*answer.penetration, truth);
  score.depthErrors.push_back(error);
  if (level == Level::refine) {
    if (!(error <= kDepthError)) blame(asked, "depth", score.outsideBound, score);
    return;
  }
  const bool inside = answer.depthIsGlobal
                          ? within(*answer.penetration, truth, answer.errorBound)
                          : preciseNumber(*answer.penetration) + answer.errorBound >= truth;
  if (!inside) blame(asked, "depth outside its bound", score.outsideBound, score);
}

bool isFinite(const Vec3& v) {
  return v.allFinite();
}

/// Each point within a few ulps of its body, and as far apart as the bodies are.
bool witnessesHold(const Case& asked, const Placed& b, const Answer& answer) {
  if (!isFinite(answer.pointA) || !isFinite(answer.pointB)) return false;
  const ExactPair pair = exactPair(asked.a, b, answer.pointA, answer.pointB);
  const double reach = std::max(reachOf(asked.a, asked.a.translation), reachOf(b, b.translation));
  const double tolerance = kWitnessUlps * ulpOf(reach);
  if (!liesWithin(pair.pointA, pair.a, pair.bits, tolerance)) return false;
  if (!liesWithin(pair.pointB, pair.b, pair.bits, tolerance)) return false;
  const mpf_class apart = distanceOf(answer.pointA, answer.pointB);
  const mpf_class truth = preciseNumber(isSeparated(asked) ? asked.truth.distance : "0");
  return mpf_class(abs(apart - truth)) <= preciseNumber(2 * tolerance);
}

void scoreWitnesses(const Case& asked, const Answer& answer, const Meshes& meshes, Score& score) {
  if (asked.truth.verdict != nameOf(answer.verdict)) return;
  Placed b = asked.b;
  if (!asked.mesh.empty()) {
    if (!answer.nearestTriangle) return;
    const Triangle& triangle = meshes.at(asked.mesh).at(*answer.nearestTriangle);
    b.points.assign(triangle.begin(), triangle.end());
  }
  if (!witnessesHold(asked, b, answer)) blame(asked, "witness points", score.witnessOff, score);
}

void scoreMesh(const Case& asked, const Answer& answer, Score& score) {
  if (asked.mesh.empty()) return;
  if (answer.penetrated != asked.truth.penetrated || answer.touched != asked.truth.touched)
    blame(asked, "lists of triangles", score.listsWrong, score);
}

void scoreTime(const Case& asked, const Answer& answer, Score& score) {
  if (!asked.course || asked.truth.tc.empty()) return;
  const auto& truth = asked.truth.toi;
  const mpf_class tc = preciseNumber(asked.truth.tc);
  bool right =
      answer.tc && preciseNumber(*answer.tc) <= tc && relativeError(*answer.tc, tc) < 1e-14;
  right = right && answer.toi.has_value() == truth.has_value();
  if (right && truth) {
    const auto [lo, hi] = *answer.toi;
    right = lo <= (*truth)[1] && hi >= (*truth)[0] && hi - lo <= kTimeWidth * (1 + hi) &&
            *answer.tc <= (*truth)[1];
  }
  if (!right) blame(asked, "time of impact", score.timeWrong, score);
}

bool isUsable(const Answer& answer) {
  return answer.error.empty() && std::isfinite(answer.distance) &&
         std::isfinite(answer.penetration.value_or(0)) && isFinite(answer.pointA) &&
         isFinite(answer.pointB);
}

/// The value that `part` of the list is not above; 0 of an empty list.
double quantile(std::vector<double> list, double part) {
  if (list.empty()) return 0;
  std::sort(list.begin(), list.end());
  const auto index = static_cast<std::size_t>(part * static_cast<double>(list.size() - 1) + 0.5);
  return list[index];
}

Score sumOf(const std::map<std::string, Score>& scores) {
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
                quantile(s.distanceErrors, 0.5), quantile(s.distanceErrors, 0.99),
                quantile(s.distanceErrors, 1), quantile(s.depthErrors, 0.5),
                quantile(s.depthErrors, 0.99), quantile(s.depthErrors, 1), s.outsideBound,
                s.boundTooWide, s.upperBounds, s.noDepth, s.witnessOff, s.listsWrong, s.timeWrong,
                s.filter / all, s.expansion / all, s.rational / all, quantile(s.nanoseconds, 0.5));
  out << line;
}

}  // namespace

void addToScore(const Case& asked, const Answer& answer, Level level, const Meshes& meshes,
                Score& score) {
  ++score.count;
  if (!isUsable(answer)) {
    blame(asked, "no answer", score.noAnswer, score);
    return;
  }
  scoreVerdict(asked, answer, score);
  if (asked.truth.near && answer.near != asked.truth.near)
    blame(asked, "near", score.nearWrong, score);
  scoreDistance(asked, answer, level, score);
  scoreDepth(asked, answer, level, score);
  scoreWitnesses(asked, answer, meshes, score);
  scoreMesh(asked, answer, score);
  scoreTime(asked, answer, score);
  ++(answer.decidedBy == DecidedBy::filter      ? score.filter
     : answer.decidedBy == DecidedBy::expansion ? score.expansion
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
  printRow("all", sumOf(scores), out);
}

}  // namespace enfilade::accuracy
