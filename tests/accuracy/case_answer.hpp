// Our answer to a case, at one of the two levels.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "collision/narrow_phase/penetration_depth.hpp"
#include "collision/narrow_phase/refine.hpp"
#include "tests/accuracy/case_file.hpp"

namespace enfilade::accuracy {

enum class Level { decide, refine };

/// Metres, seconds, world; nothing where a number is not defined.
struct Answer {
  std::string id;
  std::string error;  ///< what was thrown; everything else is void then
  collision::Verdict verdict = collision::Verdict::separated;
  collision::DecidedBy decidedBy = collision::DecidedBy::filter;
  double distance = 0;
  std::optional<double> penetration;
  bool depthIsGlobal = false;
  std::optional<bool> near;
  Vec3 pointA = Vec3::Zero(), pointB = Vec3::Zero();
  double errorBound = 0;  ///< of the distance, or of the depth where they penetrate
  double nanoseconds = 0;
  std::optional<std::uint32_t> nearestTriangle;
  std::vector<std::uint32_t> penetrated, touched;
  std::optional<double> tc;
  std::optional<std::array<double, 2>> toi;
};

/// What one coherent motion carries from step to step.
struct Warmth {
  std::vector<Vec3> pointsA, pointsB;  ///< of the last step: other lists start cold
  collision::FeatureCache features;
  collision::DepthCache depth;
};

/// Never throws: see Answer::error.
Answer answerCase(const Case& asked, const Meshes& meshes, Level level, Warmth& warmth);

/// One JSON object without a line end.
std::string jsonLine(const Case& asked, const Answer& answer);

}  // namespace enfilade::accuracy
