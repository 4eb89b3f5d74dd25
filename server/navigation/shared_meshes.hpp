// Navigation meshes that the worlds of a scene share.
#pragma once

#include <memory>

#include "scene/navigation/navigation.hpp"

namespace enfilade::server {

/// A navigation of a size. The first world of a scene builds its meshes; others load these, and
/// build the tiles around bodies that stand elsewhere. Thread-safe: a second caller for the same
/// meshes waits for the first, others do not.
std::unique_ptr<scene::Navigation> makeNavigation(const std::shared_ptr<const scene::Scene>& scene,
                                                  const scene::WorldSettings& settings,
                                                  const scene::NavigationAgent& agent,
                                                  const scene::Snapshot& snapshot);

}  // namespace enfilade::server
