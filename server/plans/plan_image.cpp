#include "server/plans/plan_image.hpp"

#include <algorithm>
#include <cmath>
#include <map>

namespace enfilade::server {
namespace {

using render::Image;

constexpr double kBelow = 1.0;        // metres below the floor that are still drawn
constexpr double kBin = 0.25;         // metres of height
constexpr double kStoreyApart = 2.0;  // metres; nearer heights are one storey

/// Heights that fall into one bin.
struct Peak {
  std::vector<WeightedHeight> heights;
  double weight = 0;
};

double medianOf(Peak& peak) {
  std::sort(peak.heights.begin(), peak.heights.end(),
            [](const auto& a, const auto& b) { return a.height < b.height; });
  double below = 0;
  for (const WeightedHeight& at : peak.heights) {
    below += at.weight;
    if (2 * below > peak.weight) return at.height;
  }
  return peak.heights.back().height;
}

}  // namespace

render::Camera planCamera(const scene::Box& bounds, double floor, double widest, double highest) {
  const Vec3 size = bounds.size();
  const double scale = std::min(widest / size.x(), highest / size.z());
  const int width = std::max(64, static_cast<int>(size.x() * scale));
  const int height = std::max(64, static_cast<int>(size.z() * scale));
  return render::plan(bounds, floor - kBelow, floor + kPlanCut, width, height);
}

Image planGround(const PlanPicture& plan) {
  Image image = plan.colour;
  const auto width = static_cast<std::size_t>(image.width);
  for (std::size_t pixel = 0; pixel < plan.ids.size(); ++pixel) {
    const bool lastColumn = pixel % width == width - 1;
    const std::uint32_t right = plan.ids[lastColumn ? pixel : pixel + 1];
    const std::uint32_t below = plan.ids[pixel + width < plan.ids.size() ? pixel + width : pixel];
    const bool edge = plan.ids[pixel] != right || plan.ids[pixel] != below;
    for (std::size_t channel = 0; channel < 3; ++channel) {
      std::uint8_t& value = image.rgb[3 * pixel + channel];
      const int soft = 255 - (255 - value) / 2;
      value = static_cast<std::uint8_t>(edge ? soft * 2 / 5 : soft);
    }
  }
  return image;
}

void paste(Image& onto, const Image& image, int left, int top) {
  for (int y = 0; y < image.height; ++y) {
    const auto from = image.rgb.begin() + static_cast<std::ptrdiff_t>(y) * image.width * 3;
    const auto to =
        onto.rgb.begin() + (static_cast<std::ptrdiff_t>(top + y) * onto.width + left) * 3;
    std::copy(from, from + static_cast<std::ptrdiff_t>(image.width) * 3, to);
  }
}

Image blankImage(int width, int height) {
  Image image{width, height, {}};
  image.rgb.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 3);
  for (std::size_t i = 0; i < image.rgb.size(); ++i) image.rgb[i] = kPlanPaper[i % 3];
  return image;
}

std::vector<double> storeyHeights(std::span<const WeightedHeight> heights, double leastShare,
                                  std::size_t most) {
  std::map<long, Peak> bins;
  double all = 0;
  for (const WeightedHeight& at : heights) {
    Peak& peak = bins[std::lround(at.height / kBin)];
    peak.heights.push_back(at);
    peak.weight += at.weight;
    all += at.weight;
  }
  std::vector<Peak> peaks;
  for (auto& [bin, peak] : bins) peaks.push_back(std::move(peak));
  std::stable_sort(peaks.begin(), peaks.end(),
                   [](const Peak& a, const Peak& b) { return a.weight > b.weight; });
  std::vector<double> storeys;
  for (Peak& peak : peaks) {
    if (storeys.size() == most || (!storeys.empty() && peak.weight < leastShare * all)) break;
    const double height = medianOf(peak);
    const bool isNew = std::none_of(storeys.begin(), storeys.end(), [&](double other) {
      return std::abs(other - height) < kStoreyApart;
    });
    if (isNew) storeys.push_back(height);
  }
  std::sort(storeys.begin(), storeys.end());
  return storeys;
}

}  // namespace enfilade::server
