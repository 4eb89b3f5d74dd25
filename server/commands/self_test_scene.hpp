// A small scene made in the program, and what its picture must look like.
#pragma once

#include <memory>
#include <string>

#include "render/frame.hpp"
#include "scene/world/data/scene.hpp"

namespace enfilade::server {

/// A room with a few boxes, one of them of glass.
std::shared_ptr<const scene::Scene> proofScene();
render::Camera proofCamera(int width, int height);

/// Why the picture, taken with a proofCamera() with all of colour, ids and depth, is not what it
/// must be; empty: it is. Devices round differently: edges may lie a pixel aside, and colours
/// differ a little.
std::string proofProblem(const render::Frame& frame);

/// The picture as proofProblem() compares it, to be written down as the golden one.
std::string proofOf(const render::Frame& frame);

}  // namespace enfilade::server
