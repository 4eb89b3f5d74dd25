// Scores the answers against the true values of the files, by family.
#pragma once

#include <iosfwd>
#include <map>
#include <string>
#include <vector>

#include "tests/accuracy/case_answer.hpp"

namespace enfilade::accuracy {

/// Maximum relative errors of distance and depth at level refine.
inline constexpr double kDistanceError = 1e-15;
inline constexpr double kDepthError = 1e-12;
/// Maximum error bound at level decide, in units of 2^-53 times the largest coordinate after the
/// translations are subtracted.
inline constexpr double kBoundUnits = 16;
/// Tolerance of witness points: ulps of the largest world coordinate of the two bodies.
inline constexpr double kWitnessUlps = 4;
/// Maximum width of a time interval, relative to (1 s + its end).
inline constexpr double kTimeWidth = 1e-12;

/// Counts of faults and statistics of one family.
struct Score {
  int count = 0;
  int noAnswer = 0;     ///< an exception, or a number that is not finite
  int wrong = 0;        ///< verdicts
  int wrongBeyond = 0;  ///< those whose distance or depth exceeds 1e-9 of the scale
  int nearWrong = 0;
  int outsideBound = 0;  ///< true distance or depth outside the reported bound
  int boundTooWide = 0;
  int witnessOff = 0;
  int listsWrong = 0;  ///< triangles of a mesh
  int timeWrong = 0;   ///< tc or toi
  int noDepth = 0;     ///< penetrating without a depth
  int upperBounds = 0;
  std::vector<std::string> faults;  ///< "id: fault", for every violated requirement
  int filter = 0, expansion = 0, rational = 0;
  std::vector<double> distanceErrors, depthErrors;  ///< relative
  std::vector<double> nanoseconds;
};

/// Adds one answer to the score of its family. `meshes`: those used for the answer.
void addToScore(const Case& testCase, const Answer& answer, Level level, const Meshes& meshes,
                Score& score);

/// Whether all requirements of the level hold.
bool holds(const Score& score);

void printScores(const std::map<std::string, Score>& scores, std::ostream& out);

}  // namespace enfilade::accuracy
