// Exact optical flow: the motion of visible points in the image, from ids, depth and poses.
#pragma once

#include "render/frame.hpp"
#include "scene/world/data/scene.hpp"

namespace enfilade::render {

/// For each pixel, the motion of its point in the image since an earlier tick, in pixels to the
/// right and down. NaN: background, not before the camera then, or not in the earlier snapshot with
/// the same shape. `frame` is a perspective frame of `now` with ids and depth,
/// without a lens; `then` has the camera of that tick.
std::vector<float> computeOpticalFlow(const Frame& frame, const scene::Scene& scene,
                                      const scene::Snapshot& now, const scene::Snapshot& then,
                                      const Camera& cameraThen);

}  // namespace enfilade::render
