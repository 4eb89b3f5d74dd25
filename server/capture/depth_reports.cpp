#include "server/capture/depth_reports.hpp"

#include <cstdio>

#include "render/image/atomic_file.hpp"
#include "server/log/log.hpp"

namespace enfilade::server {
namespace {

namespace fs = std::filesystem;

constexpr const char* kReportFolder = "depth_report";

void writeReport(const fs::path& file, const render::DepthReport& report) {
  const std::string text = render::formatReportJson(report);
  render::writeFileAtomically(file, text);
}

}  // namespace

fs::path makeDepthReportPath(std::size_t index) {
  char name[32];
  std::snprintf(name, sizeof name, "%06zu.json", index);
  return fs::path(kReportFolder) / name;
}

DepthReports::DepthReports(fs::path folder, std::shared_ptr<const scene::Scene> scene)
    : folder_(std::move(folder)), tracer_(std::move(scene)) {
  fs::create_directories(folder_ / kReportFolder);
}

void DepthReports::measure(std::size_t index, const render::Frame& frame,
                           const scene::Snapshot& snapshot, const render::FrameOptions& options) {
  const render::DepthReport report =
      render::compareWithReference(frame, tracer_.render(snapshot, frame.camera, options));
  writeReport(folder_ / makeDepthReportPath(index), report);
  render::mergeReports(total_, report);
}

void DepthReports::finish(const Shard& shard) const {
  if (total_.frames == 0) return;
  std::string name = kReportFolder;
  if (shard.count > 1)
    name += "-" + std::to_string(shard.index) + "-of-" + std::to_string(shard.count);
  writeReport(folder_ / (name + ".json"), total_);
  constexpr double kMillimetres = 1000;
  logInfo("depth error away from edges: mean {:.2g} mm, max {:.2g} mm, over {} frames",
          kMillimetres * total_.awayFromEdges.mean(), kMillimetres * total_.awayFromEdges.max,
          total_.frames);
}

}  // namespace enfilade::server
