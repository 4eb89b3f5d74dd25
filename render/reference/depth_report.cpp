#include "render/reference/depth_report.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "collision/assert.hpp"

namespace enfilade::render {
namespace {

constexpr double kFirstBinEnd = 1e-10;  // metres

std::size_t findBin(double error) {
  constexpr std::size_t kLast = std::tuple_size_v<decltype(DepthErrors::bins)> - 1;
  if (error <= kFirstBinEnd) return 0;
  const double bin = std::ceil(DepthErrors::kBinsPerDecade * std::log10(error / kFirstBinEnd));
  return static_cast<std::size_t>(std::clamp(bin, 0.0, static_cast<double>(kLast)));
}

/// Distance to the nearest edge pixel in pixels, at most `maxDistance`.
std::size_t computeDistanceToEdge(const ReferenceFrame& reference, int x, int y,
                                  std::size_t maxDistance) {
  const int width = reference.camera.width, height = reference.camera.height;
  for (int r = 0; r < static_cast<int>(maxDistance); ++r) {
    for (int v = std::max(0, y - r); v <= std::min(height - 1, y + r); ++v) {
      for (int u = std::max(0, x - r); u <= std::min(width - 1, x + r); ++u) {
        if (reference.edge[static_cast<std::size_t>(v) * static_cast<std::size_t>(width) +
                           static_cast<std::size_t>(u)])
          return static_cast<std::size_t>(r);
      }
    }
  }
  return maxDistance;
}

bool isTied(const ReferenceFrame& reference, std::size_t pixel, scene::EntityId id) {
  return std::any_of(
      std::lower_bound(reference.ties.begin(), reference.ties.end(), pixel,
                       [](const ReferenceFrame::Tie& tie, std::size_t p) { return tie.pixel < p; }),
      std::upper_bound(reference.ties.begin(), reference.ties.end(), pixel,
                       [](std::size_t p, const ReferenceFrame::Tie& tie) { return p < tie.pixel; }),
      [&](const ReferenceFrame::Tie& tie) { return tie.id == id; });
}

void compareDepth(DepthReport& report, float frameDepth, double referenceDepth, bool edge) {
  if (std::isnan(frameDepth) && std::isnan(referenceDepth)) return;
  if (std::isnan(frameDepth)) {
    ++report.missing;
    return;
  }
  if (std::isnan(referenceDepth)) {
    ++report.extra;
    return;
  }
  const double error = std::abs(static_cast<double>(frameDepth) - referenceDepth);
  (edge ? report.edges : report.awayFromEdges).addError(error);
  if (edge) return;
  std::size_t band = 0;
  while (referenceDepth > DepthReport::kBandEnds[band]) ++band;
  report.bands[band].addError(error);
}

void compareId(DepthReport& report, const ReferenceFrame& reference, int x, int y,
               std::size_t pixel, scene::EntityId frameId) {
  if (frameId == reference.ids[pixel]) {
    ++report.idsEqual;
  } else if (isTied(reference, pixel, frameId)) {
    ++report.idsTied;
  } else {
    ++report.idsDiffer[computeDistanceToEdge(reference, x, y, report.idsDiffer.size() - 1)];
  }
}

nlohmann::ordered_json toJson(const DepthErrors& errors) {
  constexpr double kMillimetres = 1000;
  return {{"pixels", errors.pixels},
          {"mean_mm", kMillimetres * errors.mean()},
          {"p99_mm", kMillimetres * errors.percentile99()},
          {"max_mm", kMillimetres * errors.max}};
}

}  // namespace

void DepthErrors::addError(double error) {
  ++pixels;
  sum += error;
  max = std::max(max, error);
  ++bins[findBin(error)];
}

void DepthErrors::mergeErrors(const DepthErrors& other) {
  pixels += other.pixels;
  sum += other.sum;
  max = std::max(max, other.max);
  for (std::size_t b = 0; b < bins.size(); ++b) bins[b] += other.bins[b];
}

double DepthErrors::percentile99() const {
  std::size_t below = 0;
  for (std::size_t b = 0; b < bins.size(); ++b) {
    below += bins[b];
    if (static_cast<double>(below) < 0.99 * static_cast<double>(pixels)) continue;
    return std::min(max, kFirstBinEnd * std::pow(10.0, static_cast<double>(b) / kBinsPerDecade));
  }
  return 0;
}

DepthReport compareWithReference(const Frame& frame, const ReferenceFrame& reference) {
  if (frame.camera.width != reference.camera.width ||
      frame.camera.height != reference.camera.height ||
      frame.depth.size() != reference.depth.size() ||
      (!frame.ids.empty() && frame.ids.size() != reference.ids.size())) {
    throw RenderError("depth report: the frame has " + std::to_string(frame.depth.size()) +
                      " pixels of depth and " + std::to_string(frame.ids.size()) +
                      " of ids, its reference " + std::to_string(reference.depth.size()) +
                      "; request the depth channel and use the same camera for the reference");
  }
  ENFILADE_ASSERT(std::ranges::is_sorted(reference.ties, {}, &ReferenceFrame::Tie::pixel));
  DepthReport report;
  report.renderer = frame.renderer;
  report.frames = 1;
  report.pixels = reference.depth.size();
  report.undecided = reference.undecided;
  std::size_t pixel = 0;
  for (int y = 0; y < reference.camera.height; ++y) {
    for (int x = 0; x < reference.camera.width; ++x, ++pixel) {
      compareDepth(report, frame.depth[pixel], reference.depth[pixel], reference.edge[pixel]);
      if (!frame.ids.empty()) compareId(report, reference, x, y, pixel, frame.ids[pixel]);
    }
  }
  return report;
}

void mergeReports(DepthReport& total, const DepthReport& one) {
  if (total.renderer.empty()) total.renderer = one.renderer;
  if (one.renderer != total.renderer) total.renderer = "several";
  total.frames += one.frames;
  total.pixels += one.pixels;
  total.awayFromEdges.mergeErrors(one.awayFromEdges);
  total.edges.mergeErrors(one.edges);
  for (std::size_t b = 0; b < total.bands.size(); ++b) total.bands[b].mergeErrors(one.bands[b]);
  total.missing += one.missing;
  total.extra += one.extra;
  total.idsEqual += one.idsEqual;
  total.idsTied += one.idsTied;
  for (std::size_t d = 0; d < total.idsDiffer.size(); ++d) total.idsDiffer[d] += one.idsDiffer[d];
  total.undecided += one.undecided;
}

std::string formatReportJson(const DepthReport& report) {
  nlohmann::ordered_json bands = nlohmann::ordered_json::array();
  double from = 0;
  for (std::size_t b = 0; b < report.bands.size(); ++b) {
    nlohmann::ordered_json band{{"from_m", from}};
    if (b + 1 < report.bands.size()) band["to_m"] = DepthReport::kBandEnds[b];
    band.update(toJson(report.bands[b]));
    bands.push_back(std::move(band));
    from = DepthReport::kBandEnds[b];
  }
  const nlohmann::ordered_json whole{{"renderer", report.renderer},
                                     {"frames", report.frames},
                                     {"pixels", report.pixels},
                                     {"depth",
                                      {{"away_from_edges", toJson(report.awayFromEdges)},
                                       {"bands", bands},
                                       {"edge_pixels", toJson(report.edges)},
                                       {"missing", report.missing},
                                       {"extra", report.extra}}},
                                     {"ids",
                                      {{"equal", report.idsEqual},
                                       {"tied", report.idsTied},
                                       {"differ_by_pixels_to_an_edge", report.idsDiffer}}},
                                     {"undecided", report.undecided}};
  return whole.dump(2) + "\n";
}

}  // namespace enfilade::render
