// What `inspect` tells of a scene, as a table for people and as JSON for programs.
#pragma once

#include <optional>
#include <string>

#include "scene/import/cache/model_cache.hpp"
#include "scene/world/queries/scene_report.hpp"
#include "server/base/load_scene.hpp"

namespace enfilade::server {

struct Inspection {
  LoadedScene loaded;
  scene::SceneReport report;
  double peakMegabytes = 0;  ///< of resident memory: the program's or the import's, the greater
};

/// Reports on the scene, by the cache where it can, and asks the system for the peak.
Inspection inspected(LoadedScene loaded, const std::optional<scene::ModelCache>& cache);

/// One JSON object, indented; with `objects` also the list "object_list": of each its id, path and
/// box, and where there are such global_id, class, operation (IFC), piece_of and only.
std::string inspectionJson(const Inspection& inspection, bool objects);

/// Lines for a terminal, some dozens; with `objects` one more for each object.
std::string inspectionTable(const Inspection& inspection, bool objects);

}  // namespace enfilade::server
