// The report of `inspect` on a scene, as a table and as JSON.
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
  double peakMegabytes = 0;  ///< peak resident memory: the maximum of program and import
};

/// Makes the report, from the cache if possible, and measures the peak memory.
Inspection makeInspection(LoadedScene loaded, const std::optional<scene::ModelCache>& cache);

/// One indented JSON object. With `objects` it has "object_list": id, path and box of each object
/// and, if known, global_id, class, operation (IFC), piece_of and only.
std::string formatInspectionJson(const Inspection& inspection, bool objects);

/// A text table for a terminal; with `objects` one more line per object.
std::string formatInspectionTable(const Inspection& inspection, bool objects);

}  // namespace enfilade::server
