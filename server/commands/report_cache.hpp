// A scene's report, or what an earlier start kept of it: its convexity is costly to work out.
#pragma once

#include <optional>
#include <string>

#include "scene/import/cache/model_cache.hpp"
#include "scene/world/queries/scene_report.hpp"

namespace enfilade::server {

/// reportOn(), which is kept in the cache where there is one. What went wrong with that is logged.
scene::SceneReport reportFor(const scene::Scene& scene,
                             const std::optional<scene::ModelCache>& cache);

/// For the cache. Reading gives nullopt for a text that writing did not make.
std::string textOf(const scene::SceneReport& report);
std::optional<scene::SceneReport> reportFrom(const std::string& text);

}  // namespace enfilade::server
