// Plan views for walk maps and for `inspect --plan`: plan cameras and plan backgrounds.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "render/camera/camera.hpp"
#include "render/image/canvas.hpp"
#include "scene/world/data/snapshot.hpp"
#include "server/floors/storeys.hpp"

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

}  // namespace enfilade::server
