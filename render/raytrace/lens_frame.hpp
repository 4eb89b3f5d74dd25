// Traces the frame of a camera with a lens: one exact ray per pixel, without stitching.
#pragma once

#include "render/frame.hpp"
#include "render/raytrace/ray_scene.hpp"
#include "render/raytrace/trace.hpp"
#include "scene/base/thread_pool.hpp"

namespace enfilade::render {

/// `camera` must have a lens and satisfy validateCamera(). The result does not depend on the number
/// of workers.
Frame traceLensFrame(const Camera& camera, const FrameOptions& options,
                     const std::vector<const RayTree*>& opaqueTrees,
                     const std::vector<const RayTree*>& transparentTrees, const Vec3& origin,
                     const MipTextures& textures, scene::ThreadPool& workers);

}  // namespace enfilade::render
