#include "server/plans/plan_image.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "collision/assert.hpp"
#include "render/avatar_mesh.hpp"
#include "render/service/renderer_selector.hpp"

namespace enfilade::server {
namespace {

using render::Image;

constexpr double kDepthBelowFloor = 1.0;    // metres drawn below the floor
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

PlanRenderer makePlanRenderer(render::RendererSelector& renderer,
                              std::shared_ptr<const scene::Snapshot> snapshot) {
  return [&renderer, snapshot = std::move(snapshot)](const render::Camera& camera) {
    const render::Frame frame = renderer.render(*snapshot, camera);
    return std::optional(PlanPicture{render::toImage(frame), frame.ids});
  };
}

render::Colour computeAvatarColour(scene::EntityId id) {
  const Eigen::Vector3f linear = render::avatarColour(id);
  const auto byte = [&](int i) {
    return static_cast<std::uint8_t>(std::lround(255 * std::pow(linear[i], 1 / 2.2f)));
  };
  return {byte(0), byte(1), byte(2)};
}

render::Camera makePlanCamera(const scene::Aabb& bounds, double floor, double maxWidth,
                              double maxHeight) {
  const Vec3 size = bounds.size();
  const double scale = std::min(maxWidth / size.x(), maxHeight / size.z());
  const int width = std::max(64, static_cast<int>(size.x() * scale));
  const int height = std::max(64, static_cast<int>(size.z() * scale));
  return render::makePlanCamera(bounds, floor - kDepthBelowFloor, floor + kPlanCutHeight, width,
                                height);
}

Image makePlanBackground(const PlanPicture& plan) {
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
