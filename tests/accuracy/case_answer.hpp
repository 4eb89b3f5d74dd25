// The answer of collision/ to a case, at one of the two levels.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "collision/narrow_phase/penetration_depth.hpp"
#include "collision/narrow_phase/refine.hpp"
#include "tests/accuracy/case_file.hpp"

namespace enfilade::accuracy {

enum class Level { decide, refine };

/// The answer to a case: metres, seconds, world frame; nullopt if a number is not defined.
struct Answer {
  std::string id;
  std::string error;  ///< text of the exception; all other fields are then invalid
  collision::Verdict verdict = collision::Verdict::separated;
  collision::Certificate certificate = collision::Certificate::filter;
  double distance = 0;
  std::optional<double> penetration;
  bool depthIsGlobal = false;
  std::optional<bool> near;
  Vec3 pointA = Vec3::Zero(), pointB = Vec3::Zero();
  double errorBound = 0;  ///< of the distance, or of the depth if penetrating
  double nanoseconds = 0;
  std::optional<std::uint32_t> nearestTriangle;
  std::vector<std::uint32_t> penetrated, touched;
  std::optional<double> tc;
  std::optional<std::array<double, 2>> toi;
};

/// The caches that one coherent motion carries from step to step.
struct WarmStart {
  std::vector<Vec3> pointsA, pointsB;  ///< of the last step; different lists cause a cold start
  collision::FeatureCache features;
  collision::DepthCache depth;
};

/// Answers a case. Never throws: see Answer::error.
Answer answerCase(const Case& testCase, const Meshes& meshes, Level level, WarmStart& warmth);

/// Formats the answer as one JSON object without a line end.
std::string formatJsonLine(const Case& testCase, const Answer& answer);

}  // namespace enfilade::accuracy
