// Error statistics of a method's answers against the truth: counts and relative errors.
#pragma once

#include "tests/benchmarks/measurement.hpp"
#include "tests/benchmarks/narrow_phase_method.hpp"

namespace enfilade::benchmarks {

/// Metres. The 64 bits of precision of long double suffice to measure the error of a double.
struct TrueAnswer {
  bool collides = false;
  long double distance = 0, depth = 0;  ///< depth 0: touching, or unknown
  /// `wrongBeyond` counts wrong verdicts if the true distance or depth exceeds 1e-9 of this.
  double scale = 1;
};

struct Errors {
  std::size_t count = 0, wrong = 0, wrongBeyond = 0, none = 0;
  std::size_t filter = 0, expansion = 0, rational = 0;
  std::size_t upperBounds = 0;          ///< depths that are not proven minimal
  std::vector<double> distance, depth;  ///< relative errors; depth includes upper bounds
  std::vector<double> provedDepth;      ///< relative errors without upper bounds

  void add(const Answer& answer, const TrueAnswer& truth) {
    ++count;
    if (answer.decidedBy == 0) ++filter;
    if (answer.decidedBy == 1) ++expansion;
    if (answer.decidedBy == 2) ++rational;
    if (answer.verdict == Answer::Verdict::none) {
      ++none;
      return;
    }
    if ((answer.verdict == Answer::Verdict::collides) != truth.collides) {
      ++wrong;
      if (std::max(truth.distance, truth.depth) > 1e-9L * truth.scale) ++wrongBeyond;
      return;
    }
    if (!truth.collides && !std::isnan(answer.distance)) {
      distance.push_back(computeRelativeError(answer.distance, truth.distance));
    }
    if (truth.depth > 0 && !std::isnan(answer.depth)) {
      depth.push_back(computeRelativeError(answer.depth, truth.depth));
      if (answer.depthProved) provedDepth.push_back(depth.back());
      if (!answer.depthProved) ++upperBounds;
    }
  }

  nlohmann::json toJson() const {
    return {{"count", count},
            {"wrong", wrong},
            {"wrong_beyond", wrongBeyond},
            {"none", none},
            {"filter", filter},
            {"expansion", expansion},
            {"rational", rational},
            {"distance_error", computeQuantiles(distance)},
            {"depth_error", computeQuantiles(depth)},
            {"upper_bounds", upperBounds},
            {"proved_depth_error", computeQuantiles(provedDepth)}};
  }

 private:
  static double computeRelativeError(double measured, long double truth) {
    return static_cast<double>(std::abs(measured - truth) / truth);
  }
  /// Median, 99th percentile, maximum; null without values.
  static nlohmann::json computeQuantiles(const std::vector<double>& values) {
    if (values.empty()) return nullptr;
    return {toJsonNumber(computeQuantile(values, 0.5)), toJsonNumber(computeQuantile(values, 0.99)),
            toJsonNumber(computeQuantile(values, 1))};
  }
};

}  // namespace enfilade::benchmarks
