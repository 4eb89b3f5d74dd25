#include "server/plans/plan_image.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "render/avatar_mesh.hpp"
#include "render/service/renderer_selector.hpp"

namespace enfilade::server {
namespace {

using render::Image;

constexpr double kDepthBelowFloor = 1.0;  // metres drawn below the floor

}  // namespace

PlanRenderer makePlanRenderer(render::RendererSelector& renderer,
                              std::shared_ptr<const scene::Snapshot> snapshot) {
  return [&renderer, snapshot = std::move(snapshot)](const render::Camera& camera) {
    const render::Frame frame = renderer.render(*snapshot, camera);
    return std::optional(PlanPicture{render::toImage(frame), frame.ids});
  };
}

render::Colour computeAvatarColour(scene::EntityId id) {
  const Eigen::Vector3f linear = render::getAvatarColour(id);
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

}  // namespace enfilade::server
