// What a person wants to see in a frame: contacts, ways walked, and whose pixels are whose.
#pragma once

#include "render/image/image.hpp"
#include "server/capture/capture_plan.hpp"

namespace enfilade::server {

/// The frame's colour with the marks that `choice` asks for drawn on it; the frame has colour, ids
/// and depth. Boxes and names are those of the pixels that are seen, so nothing hidden has any;
/// what fills most of the picture (floors, walls) has none either. Contacts and paths that lie
/// behind something are drawn thin.
render::Image drawOverlay(const render::Frame& frame, const OverlayChoice& choice,
                          const scene::Model& model, const ShotList& list, const Shot& shot);

}  // namespace enfilade::server
