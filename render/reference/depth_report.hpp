// Errors of a frame's depth and ids relative to the reference frame (reference_tracer.hpp).
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "render/frame.hpp"
#include "render/reference/reference_tracer.hpp"

namespace enfilade::render {

/// Statistics of absolute depth errors, metres.
struct DepthErrors {
  std::size_t pixels = 0;
  double sum = 0, max = 0;
  /// Histogram: bin b ends at 1e-10 * 10^(b / kBinsPerDecade) m; the last bin is unbounded.
  static constexpr int kBinsPerDecade = 40;
  std::array<std::uint64_t, 13 * kBinsPerDecade + 1> bins{};

  void addError(double error);
  void mergeErrors(const DepthErrors& other);
  double mean() const { return pixels > 0 ? sum / static_cast<double>(pixels) : 0; }
  /// 99th percentile, rounded up to the end of its bin: up to 6 % too large; <= max.
  double percentile99() const;
};

/// Errors of one frame, or of several merged ones.
struct DepthReport {
  std::string renderer;  ///< of the frames
  std::size_t frames = 0, pixels = 0;

  // Depth of pixels with a surface in both the frame and the reference.
  DepthErrors awayFromEdges;  ///< pixels that are not edges (ReferenceFrame::edge)
  DepthErrors edges;
  /// `awayFromEdges` by reference distance: 0-2, 2-5, 5-10, 10-20, 20-50, > 50 m.
  static constexpr std::array<double, 6> kBandEnds{2, 5, 10, 20, 50, 1e300};
  std::array<DepthErrors, kBandEnds.size()> bands;
  std::size_t missing = 0;  ///< pixels with a surface only in the reference
  std::size_t extra = 0;    ///< pixels with a surface only in the frame

  // Ids; all 0 if the frame has none.
  std::size_t idsEqual = 0;
  std::size_t idsTied = 0;  ///< the frame's object coincides with the reference's
  /// Pixels with another object by Chebyshev distance to the nearest edge pixel: 0 on an edge, 1
  /// next to it, ..., last: farther.
  std::array<std::size_t, 5> idsDiffer{};

  std::size_t undecided = 0;  ///< ReferenceFrame::undecided
};

/// Throws RenderError if the frame has no depth or another size.
DepthReport compareWithReference(const Frame& frame, const ReferenceFrame& reference);

/// Merges `one` into `total`.
void mergeReports(DepthReport& total, const DepthReport& one);

/// One JSON object with a trailing line break; errors in millimetres.
std::string formatReportJson(const DepthReport& report);

}  // namespace enfilade::render
