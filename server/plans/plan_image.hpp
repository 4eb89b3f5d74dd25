// Plan views for walk maps and for `inspect --plan`: storey heights, plan cameras and plan
// backgrounds.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "render/camera.hpp"
#include "render/image/canvas.hpp"
#include "scene/world/data/snapshot.hpp"

namespace enfilade::render {
class RendererSelector;
}

namespace enfilade::server {

using collision::Vec3;

/// A rendered plan with the object id of each pixel.
struct PlanPicture {
  render::Image colour;
  std::vector<std::uint32_t> ids;
};

/// Renders a plan from a camera; nullopt if not available.
using PlanRenderer = std::function<std::optional<PlanPicture>(const render::Camera&)>;

/// Renders plans of a scene in a state. `renderer` must outlive the result.
PlanRenderer makePlanRenderer(render::RendererSelector& renderer,
                              std::shared_ptr<const scene::Snapshot> snapshot);

inline constexpr double kPlanCutHeight = 1.2;  ///< metres above the floor: storeys are cut through
                                               ///< the windows, as usual for floor plans

inline constexpr render::Colour kPlanInk{40, 40, 46}, kPlanPaper{250, 249, 246};

/// An avatar's colour in rendered pictures, in sRGB.
render::Colour computeAvatarColour(scene::EntityId id);

/// Makes the camera of a plan of `bounds`, as large as fits into `maxWidth` x `maxHeight` pixels,
/// cut kPlanCutHeight above `floor`.
render::Camera makePlanCamera(const scene::Aabb& bounds, double floor, double maxWidth,
                              double maxHeight);

/// Makes a background: fades the colours, so that marks stand out, and outlines objects, because
/// cut walls are hollow and look like the floor.
render::Image makePlanBackground(const PlanPicture& plan);

/// A weighted height in metres, of feet or floors. `weight` > 0, in any unit.
struct WeightedHeight {
  double height = 0;
  double weight = 1;
};

/// Finds the heights with most weight: at most `maxCount`, ascending, at least two metres apart.
/// All but the first need at least `minShare` of the total weight.
std::vector<double> findStoreyHeights(std::span<const WeightedHeight> heights, double minShare,
                                      std::size_t maxCount);

}  // namespace enfilade::server
