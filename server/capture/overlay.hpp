// Overlays for people: contacts, trajectories, boxes and names on a frame's colour.
#pragma once

#include <string>

#include "render/image/image.hpp"
#include "server/capture/capture_plan.hpp"

namespace enfilade::server {

/// Draws the marks of `choice` on the frame's colour; the frame needs colour, ids and depth. Boxes
/// and names come from visible pixels; objects that fill most of the picture (floors, walls) get
/// none. Hidden parts of contacts and paths are drawn thin.
render::Image drawOverlay(const render::Frame& frame, const OverlayChoice& choice,
                          const scene::Model& model, const CapturePlan& plan,
                          const CaptureFrame& captureFrame);

/// A name for people, of an object's path: its last part without an IFC GlobalId, an authoring
/// tool's number, a node's number and repeated parts.
std::string makeLabelName(const std::string& path);

}  // namespace enfilade::server
