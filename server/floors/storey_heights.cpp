#include "server/floors/storey_heights.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "collision/assert.hpp"

namespace enfilade::server {
namespace {

constexpr double kBinHeight = 0.25;         // bin height in metres
constexpr double kMinStoreyDistance = 2.0;  // metres; closer heights are one storey

/// Heights that fall into one bin.
struct Peak {
  std::vector<WeightedHeight> heights;
  double weight = 0;
};

double computeMedian(Peak& peak) {
  std::sort(peak.heights.begin(), peak.heights.end(),
            [](const auto& a, const auto& b) { return a.height < b.height; });
  ENFILADE_ASSERT(!peak.heights.empty());
  double below = 0;
  for (const WeightedHeight& at : peak.heights) {
    below += at.weight;
    if (2 * below > peak.weight) return at.height;
  }
  return peak.heights.back().height;
}

}  // namespace

std::vector<double> findStoreyHeights(std::span<const WeightedHeight> heights, double minShare,
                                      std::size_t maxCount) {
  std::map<long, Peak> bins;
  double all = 0;
  for (const WeightedHeight& at : heights) {
    ENFILADE_ASSERT(at.weight > 0);
    Peak& peak = bins[std::lround(at.height / kBinHeight)];
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
    if (storeys.size() == maxCount || (!storeys.empty() && peak.weight < minShare * all)) break;
    const double height = computeMedian(peak);
    const bool isNew = std::none_of(storeys.begin(), storeys.end(), [&](double other) {
      return std::abs(other - height) < kMinStoreyDistance;
    });
    if (isNew) storeys.push_back(height);
  }
  std::sort(storeys.begin(), storeys.end());
  return storeys;
}

}  // namespace enfilade::server
