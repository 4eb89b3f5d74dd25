// Cache of scene reports, because the convexity analysis is expensive.
#pragma once

#include <optional>
#include <string>

#include "scene/import/cache/model_cache.hpp"
#include "scene/world/queries/scene_report.hpp"

namespace enfilade::server {

/// Loads the report from the cache, or makes and stores it. Cache errors are logged.
scene::SceneReport loadOrMakeReport(const scene::Scene& scene,
                                    const std::optional<scene::ModelCache>& cache);

/// Text format of the cache. Parsing returns nullopt for an invalid text.
std::string serializeReport(const scene::SceneReport& report);
std::optional<scene::SceneReport> parseReport(const std::string& text);

}  // namespace enfilade::server
