// `capture --report-depth`: compares each frame with ray-traced ground truth and writes reports.
#pragma once

#include <filesystem>
#include <memory>

#include "render/reference/depth_report.hpp"
#include "server/capture/capture_options.hpp"

namespace enfilade::server {

/// Path depth_report/NNNNNN.json of a frame's report, relative to the capture folder.
std::filesystem::path makeDepthReportPath(std::size_t index);

class DepthReports {
 public:
  /// Throws std::runtime_error if depth_report/ cannot be created in `folder`.
  DepthReports(std::filesystem::path folder, std::shared_ptr<const scene::Scene> scene);

  /// Measures a frame, which needs depth, and writes its report. `options`: those of the rendering.
  void measure(std::size_t index, const render::Frame& frame, const scene::Snapshot& snapshot,
               const render::FrameOptions& options);
  /// Writes the report over all measured frames: depth_report.json, or depth_report-I-of-N.json
  /// for a shard.
  void finish(const Shard& shard) const;

 private:
  std::filesystem::path folder_;
  render::ReferenceTracer tracer_;
  render::DepthReport total_;
};

}  // namespace enfilade::server
