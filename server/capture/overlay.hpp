// Overlays for people: contacts, trajectories, boxes and names on a frame's colour.
#pragma once

#include "render/image/image.hpp"
#include "scene/model/object_classes.hpp"
#include "server/capture/capture_frames.hpp"
#include "server/capture/capture_options.hpp"

namespace enfilade::server {

/// Draws the marks of `choice` on the frame's colour; the frame needs colour, ids and depth. Boxes
/// and names come from visible pixels: a box for each object, a name for each thing and, first, for
/// each avatar. Those that fill most of the picture (floors, walls) get none. Hidden parts of
/// contacts and paths are drawn thin.
render::Image drawOverlay(const render::Frame& frame, const OverlayChoice& choice,
                          const scene::Model& model, const scene::ObjectClasses& classes,
                          const CapturePlan& plan, const CaptureFrame& captureFrame);

}  // namespace enfilade::server
