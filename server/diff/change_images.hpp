// Pictures of changed places, before and after, and a plan with all changes.
#pragma once

#include <filesystem>

#include "render/service/renderer_selector.hpp"
#include "server/base/drawing_options.hpp"
#include "server/diff/walk_difference.hpp"

namespace enfilade::server {

struct ComparedModels {
  std::shared_ptr<const scene::Scene> before;  ///< null: not available
  std::shared_ptr<const scene::Scene> after;
  render::RendererSelector* afterRenderer = nullptr;
  DrawingOptions drawing;  ///< options of the second renderer
};

/// Writes at most `maxPictures` files changes/NNN.png below `folder`, worst changes first, and
/// changes/map.png. Stores each picture's name in its changes; close changes of one pair share a
/// picture. Replays both walks for the moments. Throws render::RenderError, std::runtime_error.
void drawChanges(WalkDifference& difference, const ComparedModels& models,
                 std::uint32_t maxPictures, const std::filesystem::path& folder);

}  // namespace enfilade::server
