// The report of `inspect` on a scene, as a table and as JSON.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "scene/import/cache/model_cache.hpp"
#include "scene/model/diagnostic_catalog.hpp"
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

/// Accepts all warnings, in a list of accepted kinds.
inline constexpr std::string_view kAllWarnings = "warnings";

/// A diagnostic of the report with its meaning.
struct InspectedDiagnostic {
  const scene::Diagnostic* diagnostic = nullptr;
  scene::DiagnosticKind kind;
  bool accepted = false;  ///< `--strict` does not fail because of it

  bool fails() const { return kind.severity != scene::Severity::note && !accepted; }
};

/// The report's problems: errors, then warnings, then notes. `accepted` holds the kinds that the
/// user accepts, or kAllWarnings.
std::vector<InspectedDiagnostic> listDiagnostics(const scene::SceneReport& report,
                                                 const std::vector<std::string>& accepted);

struct ClassCount {
  std::string name;
  std::size_t objects = 0;
};

/// Objects by IFC class, most first; empty if the file has no classes. With `storey`: those of this
/// storey.
std::vector<ClassCount> countClasses(const scene::Model& model,
                                     std::optional<std::uint32_t> storey = std::nullopt);
/// Objects of a storey, without parts of others.
std::size_t countObjects(const scene::Model& model, std::uint32_t storey);

/// One indented JSON object. With `objects` it has "object_list": id, path and box of each object
/// and, if known, global_id, class, operation (IFC), piece_of and only.
std::string formatInspectionJson(const Inspection& inspection,
                                 const std::vector<std::string>& accepted, bool objects);

/// A text table for a terminal; with `objects` one more line per object.
std::string formatInspectionTable(const Inspection& inspection,
                                  const std::vector<std::string>& accepted, bool objects);

}  // namespace enfilade::server
