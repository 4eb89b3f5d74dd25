#include "render/reference/depth_report.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace enfilade::render {
namespace {

constexpr double kFirstBinEnd = 1e-10;  // metres

std::size_t binOf(double error) {
  constexpr std::size_t kLast = std::tuple_size_v<decltype(DepthErrors::bins)> - 1;
  if (error <= kFirstBinEnd) return 0;
  const double bin = std::ceil(DepthErrors::kBinsPerDecade * std::log10(error / kFirstBinEnd));
  return static_cast<std::size_t>(std::clamp(bin, 0.0, static_cast<double>(kLast)));
}

/// To the nearest edge pixel, in pixels; `far` where there is none nearer.
std::size_t distanceToEdge(const TrueFrame& truth, int x, int y, std::size_t far) {
  const int width = truth.camera.width, height = truth.camera.height;
  for (int r = 0; r < static_cast<int>(far); ++r) {
    for (int v = std::max(0, y - r); v <= std::min(height - 1, y + r); ++v) {
      for (int u = std::max(0, x - r); u <= std::min(width - 1, x + r); ++u) {
        if (truth.edge[static_cast<std::size_t>(v) * static_cast<std::size_t>(width) +
                       static_cast<std::size_t>(u)])
          return static_cast<std::size_t>(r);
      }
    }
  }
  return far;
}

bool tied(const TrueFrame& truth, std::size_t pixel, scene::EntityId id) {
  return std::any_of(
      std::lower_bound(truth.ties.begin(), truth.ties.end(), pixel,
                       [](const TrueFrame::Tie& tie, std::size_t p) { return tie.pixel < p; }),
      std::upper_bound(truth.ties.begin(), truth.ties.end(), pixel,
                       [](std::size_t p, const TrueFrame::Tie& tie) { return p < tie.pixel; }),
      [&](const TrueFrame::Tie& tie) { return tie.id == id; });
}

void compareDepth(DepthReport& report, float seen, double truth, bool edge) {
  if (std::isnan(seen) && std::isnan(truth)) return;
  if (std::isnan(seen)) {
    ++report.missing;
    return;
  }
  if (std::isnan(truth)) {
    ++report.extra;
    return;
  }
  const double error = std::abs(static_cast<double>(seen) - truth);
  (edge ? report.edges : report.away).add(error);
  if (edge) return;
  std::size_t band = 0;
  while (truth > DepthReport::kBandEnds[band]) ++band;
  report.bands[band].add(error);
}

void compareId(DepthReport& report, const TrueFrame& truth, int x, int y, std::size_t pixel,
               scene::EntityId seen) {
  if (seen == truth.ids[pixel]) {
    ++report.idsEqual;
  } else if (tied(truth, pixel, seen)) {
    ++report.idsTied;
  } else {
    ++report.idsDiffer[distanceToEdge(truth, x, y, report.idsDiffer.size() - 1)];
  }
}

nlohmann::ordered_json json(const DepthErrors& errors) {
  constexpr double kMillimetres = 1000;
  return {{"pixels", errors.pixels},
          {"mean_mm", kMillimetres * errors.mean()},
          {"p99_mm", kMillimetres * errors.percentile99()},
          {"max_mm", kMillimetres * errors.greatest}};
}

}  // namespace

void DepthErrors::add(double error) {
  ++pixels;
  sum += error;
  greatest = std::max(greatest, error);
  ++bins[binOf(error)];
}

void DepthErrors::add(const DepthErrors& other) {
  pixels += other.pixels;
  sum += other.sum;
  greatest = std::max(greatest, other.greatest);
  for (std::size_t b = 0; b < bins.size(); ++b) bins[b] += other.bins[b];
}

double DepthErrors::percentile99() const {
  std::size_t below = 0;
  for (std::size_t b = 0; b < bins.size(); ++b) {
    below += bins[b];
    if (static_cast<double>(below) < 0.99 * static_cast<double>(pixels)) continue;
    return std::min(greatest,
                    kFirstBinEnd * std::pow(10.0, static_cast<double>(b) / kBinsPerDecade));
  }
  return 0;
}

DepthReport compareWithTruth(const Frame& frame, const TrueFrame& truth) {
  if (frame.camera.width != truth.camera.width || frame.camera.height != truth.camera.height ||
      frame.depth.size() != truth.depth.size() ||
      (!frame.ids.empty() && frame.ids.size() != truth.ids.size())) {
    throw RenderError("depth report: the picture has " + std::to_string(frame.depth.size()) +
                      " pixels of depth and " + std::to_string(frame.ids.size()) +
                      " of ids, its truth " + std::to_string(truth.depth.size()) +
                      "; ask for the depth channel, and for the truth of the same camera");
  }
  DepthReport report;
  report.renderer = frame.renderer;
  report.frames = 1;
  report.pixels = truth.depth.size();
  report.undecided = truth.undecided;
  std::size_t pixel = 0;
  for (int y = 0; y < truth.camera.height; ++y) {
    for (int x = 0; x < truth.camera.width; ++x, ++pixel) {
      compareDepth(report, frame.depth[pixel], truth.depth[pixel], truth.edge[pixel]);
      if (!frame.ids.empty()) compareId(report, truth, x, y, pixel, frame.ids[pixel]);
    }
  }
  return report;
}

void add(DepthReport& total, const DepthReport& one) {
  if (total.renderer.empty()) total.renderer = one.renderer;
  if (one.renderer != total.renderer) total.renderer = "several";
  total.frames += one.frames;
  total.pixels += one.pixels;
  total.away.add(one.away);
  total.edges.add(one.edges);
  for (std::size_t b = 0; b < total.bands.size(); ++b) total.bands[b].add(one.bands[b]);
  total.missing += one.missing;
  total.extra += one.extra;
  total.idsEqual += one.idsEqual;
  total.idsTied += one.idsTied;
  for (std::size_t d = 0; d < total.idsDiffer.size(); ++d) total.idsDiffer[d] += one.idsDiffer[d];
  total.undecided += one.undecided;
}

std::string jsonOf(const DepthReport& report) {
  nlohmann::ordered_json bands = nlohmann::ordered_json::array();
  double from = 0;
  for (std::size_t b = 0; b < report.bands.size(); ++b) {
    nlohmann::ordered_json band{{"from_m", from}};
    if (b + 1 < report.bands.size()) band["to_m"] = DepthReport::kBandEnds[b];
    band.update(json(report.bands[b]));
    bands.push_back(std::move(band));
    from = DepthReport::kBandEnds[b];
  }
  const nlohmann::ordered_json whole{{"renderer", report.renderer},
                                     {"frames", report.frames},
                                     {"pixels", report.pixels},
                                     {"depth",
                                      {{"away_from_edges", json(report.away)},
                                       {"bands", bands},
                                       {"edge_pixels", json(report.edges)},
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
