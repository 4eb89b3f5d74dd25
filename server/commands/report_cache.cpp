#include "server/commands/report_cache.hpp"

#include <spdlog/spdlog.h>

#include <nlohmann/json.hpp>

namespace enfilade::server {
namespace {

using json = nlohmann::json;

/// Calls `visit` with the name of each number of the report and the number.
template <class Report, class Visit>
void visitNumbers(Report& report, const Visit& visit) {
  visit("objects", report.objects);
  visit("solid_objects", report.solidObjects);
  visit("meshes", report.meshes);
  visit("triangles", report.triangles);
  visit("unique_triangles", report.uniqueTriangles);
  visit("unique_positions", report.uniquePositions);
  visit("exact", report.shells.exact);
  visit("rounded", report.shells.rounded);
  visit("hollow", report.shells.hollow);
  visit("inward", report.shells.inward);
  visit("closed", report.shells.closed);
  visit("open", report.shells.open);
  visit("hull_triangles", report.hullTriangles);
  visit("part_triangles", report.partTriangles);
}

json jsonOf(const std::vector<scene::Problem>& problems) {
  json list = json::array();
  for (const scene::Problem& p : problems)
    list.push_back({{"kind", p.kind}, {"count", p.count}, {"example", p.example}});
  return list;
}

std::string dumped(const json& value) {
  return value.dump(-1, ' ', false, json::error_handler_t::replace);
}

/// The report follows from what the scene's hash is of, from how the model shares its meshes and
/// objects belong together, and from what the import found.
std::string keyOf(const scene::Scene& scene) {
  const scene::Model& model = scene.model();
  std::string key = "report 2 scene " + std::to_string(scene.hash()) + " meshes";
  for (const scene::Mesh& mesh : model.meshes)
    key += " " + std::to_string(mesh.positions.size()) + "/" + std::to_string(mesh.indices.size());
  key += " pieces";
  for (std::size_t i = 0; i < model.objects.size(); ++i)
    if (model.objects[i].pieceOf) key += " " + std::to_string(i);
  return key + " problems " + dumped(jsonOf(model.problems));
}

}  // namespace

std::string textOf(const scene::SceneReport& report) {
  json text;
  visitNumbers(report, [&](const char* name, std::size_t number) { text[name] = number; });
  text["problems"] = jsonOf(report.problems);
  return dumped(text);
}

std::optional<scene::SceneReport> reportFrom(const std::string& text) {
  try {
    const json read = json::parse(text);
    scene::SceneReport report;
    visitNumbers(report, [&](const char* name, std::size_t& number) {
      number = read.at(name).get<std::size_t>();
    });
    for (const json& p : read.at("problems"))
      report.problems.push_back({p.at("kind"), p.at("count"), p.at("example")});
    return report;
  } catch (const json::exception&) {
    return std::nullopt;
  }
}

scene::SceneReport reportFor(const scene::Scene& scene,
                             const std::optional<scene::ModelCache>& cache) {
  if (!cache) return reportOn(scene);
  const std::string key = keyOf(scene);
  if (const auto kept = scene::keptText(*cache, key))
    if (auto report = reportFrom(*kept)) return std::move(*report);
  scene::SceneReport report = reportOn(scene);
  const std::string wrong = scene::keepText(*cache, key, textOf(report));
  if (!wrong.empty()) spdlog::warn("cache: the report is not kept for the next start: {}", wrong);
  return report;
}

}  // namespace enfilade::server
