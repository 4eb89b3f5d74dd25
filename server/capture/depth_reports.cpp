#include "server/capture/depth_reports.hpp"

#include <spdlog/spdlog.h>

#include <cstdio>

#include "render/image/image.hpp"

namespace enfilade::server {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFolder = "depth_report";

void write(const fs::path& file, const render::DepthReport& report) {
  const std::string text = render::jsonOf(report);
  render::writeFileWhole(file, text.data(), text.size());
}

}  // namespace

fs::path depthReportOf(std::size_t index) {
  char name[32];
  std::snprintf(name, sizeof name, "%06zu.json", index);
  return fs::path(kFolder) / name;
}

DepthReports::DepthReports(fs::path folder, std::shared_ptr<const scene::Scene> scene)
    : folder_(std::move(folder)), rays_(std::move(scene)) {
  fs::create_directories(folder_ / kFolder);
}

void DepthReports::measure(std::size_t index, const render::Frame& frame,
                           const scene::Snapshot& snapshot, const render::FrameOptions& options) {
  const render::DepthReport report =
      render::compareWithTruth(frame, rays_.look(snapshot, frame.camera, options));
  write(folder_ / depthReportOf(index), report);
  render::add(total_, report);
}

void DepthReports::finish(const Shard& shard) const {
  if (total_.frames == 0) return;
  std::string name = kFolder;
  if (shard.count > 1)
    name += "-" + std::to_string(shard.index) + "-of-" + std::to_string(shard.count);
  write(folder_ / (name + ".json"), total_);
  constexpr double kMillimetres = 1000;
  spdlog::info("depth away from edges: mean {:.2g} mm, at most {:.2g} mm, over {} frames",
               kMillimetres * total_.away.mean(), kMillimetres * total_.away.greatest,
               total_.frames);
}

}  // namespace enfilade::server
