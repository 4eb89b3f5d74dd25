// How far a picture's depth and ids are from the truth (render/reference/reference_tracer.hpp).
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "render/frame.hpp"
#include "render/reference/reference_tracer.hpp"

namespace enfilade::render {

/// Absolute differences of depth, metres.
struct DepthErrors {
  std::size_t pixels = 0;
  double sum = 0, greatest = 0;
  /// Pixels by size of error: bin b ends at 1e-10 * 10^(b / kBinsPerDecade) m; the last has no end.
  static constexpr int kBinsPerDecade = 40;
  std::array<std::uint64_t, 13 * kBinsPerDecade + 1> bins{};

  void add(double error);
  void add(const DepthErrors& other);
  double mean() const { return pixels > 0 ? sum / static_cast<double>(pixels) : 0; }
  /// The end of the bin below which 99 of 100 pixels lie: up to 6 % too large; <= greatest.
  double percentile99() const;
};

struct DepthReport {
  std::string renderer;  ///< of the frames
  std::size_t frames = 0, pixels = 0;

  // Depth: where both the picture and the truth see something.
  DepthErrors away;  ///< away from edges (TrueFrame::edge)
  DepthErrors edges;
  /// `away` by true distance: 0-2, 2-5, 5-10, 10-20, 20-50, > 50 m.
  static constexpr std::array<double, 6> kBandEnds{2, 5, 10, 20, 50, 1e300};
  std::array<DepthErrors, kBandEnds.size()> bands;
  std::size_t missing = 0;  ///< pixels where only the truth sees something
  std::size_t extra = 0;    ///< where only the picture does

  // Ids; all 0 where the picture has none.
  std::size_t idsEqual = 0;
  std::size_t idsTied = 0;  ///< the picture's object is in the same place as the truth's
  /// Pixels with another object, by how far the nearest edge pixel is, in pixels (the larger of
  /// both axes): 0 on an edge, 1 beside it, ..., the last: farther.
  std::array<std::size_t, 5> idsDiffer{};

  std::size_t undecided = 0;  ///< TrueFrame::undecided
};

/// Throws RenderError where the frame has no depth or is of another size.
DepthReport compareWithTruth(const Frame& frame, const TrueFrame& truth);

/// Takes `one` into `total`.
void add(DepthReport& total, const DepthReport& one);

/// One JSON object, lengths in millimetres, with a line break at the end.
std::string jsonOf(const DepthReport& report);

}  // namespace enfilade::render
