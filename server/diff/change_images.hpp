// Pictures of the places that changed, before and after, and a plan with all of them.
#pragma once

#include <filesystem>

#include "render/service/renderer.hpp"
#include "server/app/command_line.hpp"
#include "server/diff/walk_difference.hpp"

namespace enfilade::server {

struct ComparedModels {
  std::shared_ptr<const scene::Scene> before;  ///< null: it cannot be had
  std::shared_ptr<const scene::Scene> after;
  render::Renderer* afterRenderer = nullptr;
  DrawingOptions drawing;  ///< of the other renderer
};

/// Writes changes/NNN.png below `folder`, at most `most`, the worst changes first, and
/// changes/map.png; notes each picture's name in its changes. Changes of one pair near one another
/// share a picture. Makes both walks again for the moments that are drawn. Throws
/// render::RenderError, std::runtime_error.
void drawChanges(WalkDifference& difference, const ComparedModels& models, std::uint32_t most,
                 const std::filesystem::path& folder);

}  // namespace enfilade::server
