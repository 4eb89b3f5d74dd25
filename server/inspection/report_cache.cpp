#include "server/inspection/report_cache.hpp"

#include <nlohmann/json.hpp>

#include "server/log/log.hpp"

namespace enfilade::server {
namespace {

/// Calls `visit` with the key and value of each number of the report.
template <class Report, class Visit>
void visitNumbers(Report& report, const Visit& visit) {
  visit("objects", report.objects);
  visit("solid_objects", report.solidObjects);
  visit("meshes", report.meshes);
  visit("triangles", report.triangles);
  visit("unique_triangles", report.uniqueTriangles);
  visit("unique_positions", report.uniquePositions);
  visit("exact", report.shells.exact);
  visit("rounded", report.shells.nearlyConvex);
  visit("hollow", report.shells.hollow);
  visit("inward", report.shells.inward);
  visit("closed", report.shells.closed);
  visit("open", report.shells.open);
  visit("hull_triangles", report.hullTriangles);
  visit("part_triangles", report.partTriangles);
}

nlohmann::json toJson(const std::vector<scene::Diagnostic>& problems) {
  nlohmann::json list = nlohmann::json::array();
  for (const scene::Diagnostic& p : problems)
    list.push_back({{"kind", p.kind}, {"count", p.count}, {"example", p.example}});
  return list;
}

std::string dumpJson(const nlohmann::json& value) {
  return value.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

/// All that decides how a surface looks.
std::string formatMaterial(const scene::Material& material) {
  const auto& m = material;
  return dumpJson({{m.baseColour.x(), m.baseColour.y(), m.baseColour.z(), m.baseColour.w()},
                   {m.emissive.x(), m.emissive.y(), m.emissive.z()},
                   m.metallic,
                   m.roughness,
                   static_cast<int>(m.alpha),
                   m.baseColourTexture});
}

/// Makes the cache key. The report depends on the scene hash, on shared meshes and their materials,
/// on groups of objects, and on the problems found by the import.
std::string makeCacheKey(const scene::Scene& scene) {
  const scene::Model& model = scene.model();
  std::string key = "report 3 scene " + std::to_string(scene.hash()) + " meshes";
  for (const scene::Mesh& mesh : model.meshes)
    key += " " + std::to_string(mesh.positions.size()) + "/" + std::to_string(mesh.indices.size()) +
           "/" + std::to_string(mesh.material);
  key += " materials";
  for (const scene::Material& material : model.materials) key += " " + formatMaterial(material);
  key += " pieces";
  for (std::size_t i = 0; i < model.objects.size(); ++i)
    if (model.objects[i].partOf) key += " " + std::to_string(i);
  return key + " problems " + dumpJson(toJson(model.diagnostics));
}

}  // namespace

std::string serializeReport(const scene::SceneReport& report) {
  nlohmann::json text;
  visitNumbers(report, [&](const char* name, std::size_t number) { text[name] = number; });
  text["problems"] = toJson(report.diagnostics);
  return dumpJson(text);
}

std::optional<scene::SceneReport> parseReport(const std::string& text) {
  try {
    const nlohmann::json read = nlohmann::json::parse(text);
    scene::SceneReport report;
    visitNumbers(report, [&](const char* name, std::size_t& number) {
      number = read.at(name).get<std::size_t>();
    });
    for (const nlohmann::json& p : read.at("problems"))
      report.diagnostics.push_back({p.at("kind"), p.at("count"), p.at("example")});
    return report;
  } catch (const nlohmann::json::exception&) {
    return std::nullopt;
  }
}

scene::SceneReport loadOrMakeReport(const scene::Scene& scene,
                                    const std::optional<scene::ModelCache>& cache) {
  if (!cache) return makeSceneReport(scene);
  const std::string key = makeCacheKey(scene);
  if (const auto cached = scene::loadCachedText(*cache, key))
    if (auto report = parseReport(*cached)) return std::move(*report);
  scene::SceneReport report = makeSceneReport(scene);
  const std::string problem = scene::storeCachedText(*cache, key, serializeReport(report));
  if (!problem.empty()) logWarning("cache: the report cannot be stored: {}", problem);
  return report;
}

}  // namespace enfilade::server
