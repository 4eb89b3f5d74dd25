// `capture --report-depth`: each frame beside rays in doubles, told in a file beside it.
#pragma once

#include <filesystem>
#include <memory>

#include "render/reference/depth_report.hpp"
#include "server/capture/capture_options.hpp"

namespace enfilade::server {

/// depth_report/NNNNNN.json of a frame; render::jsonOf() says what is in it.
std::filesystem::path depthReportOf(std::size_t index);

class DepthReports {
 public:
  /// Throws std::runtime_error where depth_report/ cannot be made in `folder`.
  DepthReports(std::filesystem::path folder, std::shared_ptr<const scene::Scene> scene);

  /// `frame` has its depth; `options` are those it was drawn with. Writes the frame's report.
  void measure(std::size_t index, const render::Frame& frame, const scene::Snapshot& snapshot,
               const render::FrameOptions& options);
  /// Writes what was measured since the beginning as one report: depth_report.json, or of a shard
  /// depth_report-I-of-N.json.
  void finish(const Shard& shard) const;

 private:
  std::filesystem::path folder_;
  render::TrueRays rays_;
  render::DepthReport total_;
};

}  // namespace enfilade::server
