// The self-test of renderers: a small built-in scene and its expected picture.
#pragma once

#include <memory>
#include <string>

#include "render/frame.hpp"
#include "scene/world/data/scene.hpp"

namespace enfilade::server {

/// Makes a room with a few boxes, one of them of glass.
std::shared_ptr<const scene::Scene> makeSelfTestScene();
render::Camera makeSelfTestCamera(int width, int height);

/// Validates a frame of makeSelfTestCamera() with colour, ids and depth; empty: valid. Tolerances
/// allow for rounding of devices: edges may shift by a pixel, and colours may differ slightly.
std::string validateSelfTestFrame(const render::Frame& frame);

}  // namespace enfilade::server
