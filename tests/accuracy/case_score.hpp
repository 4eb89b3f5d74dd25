// Our answers against the truth of the files, by family.
#pragma once

#include <iosfwd>
#include <map>
#include <string>
#include <vector>

#include "tests/accuracy/case_answer.hpp"

namespace enfilade::accuracy {

/// What must hold at refine: relative errors of distance and depth.
inline constexpr double kDistanceError = 1e-15;
inline constexpr double kDepthError = 1e-12;
/// At decide: the widest error bound, in units of rounding (2^-53) of the largest coordinate after
/// the translations are subtracted.
inline constexpr double kBoundUnits = 16;
/// Witness points: ulps of the largest coordinate of the two bodies, in the world.
inline constexpr double kWitnessUlps = 4;
/// Width of an interval of time: of (1 s + its end).
inline constexpr double kTimeWidth = 1e-12;

struct Score {
  int count = 0;
  int noAnswer = 0;     ///< an exception, or a number that is none
  int wrong = 0;        ///< verdicts
  int wrongBeyond = 0;  ///< those whose distance or depth exceeds 1e-9 of the scale
  int nearWrong = 0;
  int outsideBound = 0;  ///< true distance or depth outside what was claimed
  int boundTooWide = 0;
  int witnessOff = 0;
  int listsWrong = 0;  ///< triangles of a mesh
  int timeWrong = 0;   ///< tc or toi
  int noDepth = 0;     ///< penetrating without a depth
  int upperBounds = 0;
  std::vector<std::string> faults;  ///< "id: what", of all that must hold
  int filter = 0, expansion = 0, rational = 0;
  std::vector<double> distanceErrors, depthErrors;  ///< relative
  std::vector<double> nanoseconds;
};

/// Adds one answer to the score of its family. `meshes` as the answer was made with.
void addToScore(const Case& asked, const Answer& answer, Level level, const Meshes& meshes,
                Score& score);

/// Whether all that must hold at the level does.
bool holds(const Score& score);

void printScores(const std::map<std::string, Score>& scores, std::ostream& out);

}  // namespace enfilade::accuracy
