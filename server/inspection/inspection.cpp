#include "server/inspection/inspection.hpp"

#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>

#include "collision/sine_cosine.hpp"
#include "server/inspection/report_cache.hpp"

namespace enfilade::server {
namespace {

using Json = nlohmann::ordered_json;
using scene::Aabb;
using scene::Vec3;

constexpr std::size_t kMaxListedObjects = 5;  // objects in the table
constexpr std::size_t kMaxListedBodies = 12;  // bodies in the table

double measurePeakMegabytes(int who) {
  rusage usage{};
  getrusage(who, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

// ---- JSON ---------------------------------------------------------------------------------------

Json toJson(const Vec3& v) {
  return Json::array({v.x(), v.y(), v.z()});
}

Json toJson(const Aabb& box) {
  if (box.empty()) return nullptr;
  return {{"min", toJson(box.min)}, {"max", toJson(box.max)}, {"size", toJson(box.size())}};
}

Json toJson(const scene::ShellCounts& shells) {
  return {{"convex_exact", shells.exact}, {"convex_rounded", shells.nearlyConvex},
          {"hollow", shells.hollow},      {"inward", shells.inward},
          {"closed", shells.closed},      {"open", shells.open}};
}

Json toJson(const std::vector<InspectedDiagnostic>& problems) {
  Json list = Json::array();
  for (const InspectedDiagnostic& entry : problems)
    list.push_back({{"kind", entry.diagnostic->kind},
                    {"severity", toString(entry.kind.severity)},
                    {"count", entry.diagnostic->count},
                    {"example", entry.diagnostic->example},
                    {"note", entry.kind.severity == scene::Severity::note},
                    {"accepted", entry.accepted},
                    {"meaning", entry.kind.meaning}});
  return list;
}

Json toJson(const std::vector<ClassCount>& classes) {
  Json counts = Json::object();
  for (const ClassCount& entry : classes) counts[entry.name] = entry.objects;
  return counts;
}

Json storeysToJson(const scene::Model& model) {
  Json list = Json::array();
  for (std::uint32_t i = 0; i < model.storeys.size(); ++i) {
    const scene::Storey& storey = model.storeys[i];
    list.push_back({{"name", storey.name},
                    {"elevation", storey.elevation},
                    {"global_id", storey.globalId},
                    {"objects", countObjects(model, i)},
                    {"classes", toJson(countClasses(model, i))}});
  }
  return list;
}

Json spacesToJson(const scene::Model& model) {
  Json list = Json::array();
  for (const scene::Space& space : model.spaces)
    list.push_back({{"name", space.name},
                    {"long_name", space.longName},
                    {"global_id", space.globalId},
                    {"storey", space.storey ? Json(model.storeys[*space.storey].name) : Json()},
                    {"box", toJson(space.box)}});
  return list;
}

/// Degrees in the plane of the floor: 0 looks along +x, 90 along -z.
double computeFacing(const Eigen::Vector2d& direction) {
  return std::atan2(-direction.y(), direction.x()) * collision::kDegreesPerRadian + 0.0;  // no -0
}

Json northToJson(const std::optional<Eigen::Vector2d>& north) {
  if (!north) return nullptr;
  return {{"x", north->x()}, {"z", north->y()}, {"facing", computeFacing(*north)}};
}

Json objectsToJson(const scene::Scene& scene) {
  Json list = Json::array();
  for (std::uint32_t i = 0; i < scene.model().objects.size(); ++i) {
    const scene::Object& object = scene.model().objects[i];
    Json entry{
        {"id", i + 1}, {"path", object.path}, {"box", toJson(computeAuthoredAabb(scene, i))}};
    if (!object.globalId.empty()) entry["global_id"] = object.globalId;
    if (!object.ifcClass.empty()) entry["class"] = object.ifcClass;
    if (object.storey) entry["storey"] = scene.model().storeys[*object.storey].name;
    if (!object.operationType.empty()) entry["operation"] = object.operationType;
    if (object.partOf) entry["piece_of"] = *object.partOf + 1;
    for (const scene::ObjectAttribute& attribute : object.attributes)
      entry["attributes"][attribute.name] = attribute.values;
    if (object.usage != scene::Object::Usage::both)
      entry["only"] = object.usage == scene::Object::Usage::visualOnly ? "drawn" : "solid";
    list.push_back(std::move(entry));
  }
  return list;
}

/// Position and range of a body. Keys that depend on the kind appear only for that kind.
Json toJson(const scene::Model& model, const scene::BodySpec& body) {
  Json objects = Json::array();
  for (const std::uint32_t object : body.objects) objects.push_back(model.objects[object].path);
  Json entry{{"name", body.name},
             {"kind", toString(body.kind)},
             {"source", toString(body.source)},
             {"objects", std::move(objects)},
             {"anchor", toJson(body.anchor)},
             {"axis", toJson(body.axis)}};
  const scene::BodyKindTraits traits = getTraits(body.kind);
  if (traits.takesLimits) {
    entry["low"] = body.low;
    entry["high"] = body.high;
    entry["speed"] = body.speed;
  }
  if (traits.takesStops) entry["stops"] = body.stops;
  if (traits.takesKeys) {
    entry["seconds"] = body.keys.back().time;
    entry["speed"] = body.speed;
    entry["loops"] = body.loops;
    entry["runs"] = body.autoStart;
    for (const scene::PathKey& key : body.keys)
      entry["keys"].push_back(
          {{"time", key.time}, {"offset", toJson(key.offset)}, {"turn", key.angle}});
  }
  if (isDynamic(body.kind)) {
    if (body.mass)
      entry["mass"] = *body.mass;
    else
      entry["density"] = body.density;
  }
  return entry;
}

Json bodiesToJson(const scene::Model& model) {
  Json list = Json::array();
  for (const scene::BodySpec& body : model.bodies) list.push_back(toJson(model, body));
  return list;
}

// ---- table --------------------------------------------------------------------------------------

class TextTable {
 public:
  __attribute__((format(printf, 2, 3))) void appendLine(const char* format, ...) {
    std::va_list arguments;
    va_start(arguments, format);
    std::va_list copy;
    va_copy(copy, arguments);
    std::string text(static_cast<std::size_t>(std::vsnprintf(nullptr, 0, format, arguments)) + 1,
                     '\0');
    std::vsnprintf(text.data(), text.size(), format, copy);
    va_end(copy);
    va_end(arguments);
    text.back() = '\n';
    text_ += text;
  }
  std::string release() { return std::move(text_); }

 private:
  std::string text_;
};

void addSummary(const Inspection& inspection, TextTable& table) {
  const scene::Scene& scene = *inspection.loaded.scene;
  const scene::Model& model = scene.model();
  const scene::SceneReport& report = inspection.report;
  const Vec3 low = scene.bounds().empty() ? Vec3::Zero().eval() : scene.bounds().min;
  const Vec3 high = scene.bounds().empty() ? Vec3::Zero().eval() : scene.bounds().max;
  table.appendLine("%s", model.source.c_str());
  if (!model.reader.empty()) table.appendLine("  read by     %s", model.reader.c_str());
  table.appendLine("  size        %.3f x %.3f x %.3f m", high.x() - low.x(), high.y() - low.y(),
                   high.z() - low.z());
  table.appendLine("  from        %.3f, %.3f, %.3f", low.x(), low.y(), low.z());
  table.appendLine("  to          %.3f, %.3f, %.3f", high.x(), high.y(), high.z());
  table.appendLine("  unit        %g m; up in the file: %s", model.metresPerUnit,
                   toString(model.upAxis).c_str());
  table.appendLine("  offset      %.3f, %.3f, %.3f m subtracted from the file", model.offset.x(),
                   model.offset.y(), model.offset.z());
  if (!model.map.empty())
    table.appendLine("  map         %s: x east, y up, -z north", model.map.c_str());
  if (model.north)
    table.appendLine("  north       facing %.3f: x %.6f, z %.6f", computeFacing(*model.north),
                     model.north->x(), model.north->y());
  if (model.fileScenes.size() > 1) {
    table.appendLine("  scenes      %zu in the file, of which %u was read", model.fileScenes.size(),
                     model.fileScene);
    for (std::size_t i = 0; i < model.fileScenes.size(); ++i)
      table.appendLine("              %zu  %s", i, model.fileScenes[i].c_str());
  }
  table.appendLine("  objects     %zu, of which %zu are solid; %zu meshes", report.objects,
                   report.solidObjects, report.meshes);
  table.appendLine("  triangles   %zu; %zu in the meshes", report.triangles,
                   report.uniqueTriangles);
  const std::size_t convex = report.shells.exact + report.shells.nearlyConvex;
  table.appendLine("  convex      %zu convex parts: %zu exact, %zu nearly convex", convex,
                   report.shells.exact, report.shells.nearlyConvex);
  table.appendLine("              replace %zu triangles; %zu remain", report.hullTriangles,
                   report.partTriangles);
  table.appendLine(
      "  the rest    %zu closed shells, %zu open, %zu around a cavity, %zu seen from inside",
      report.shells.closed, report.shells.open, report.shells.hollow, report.shells.inward);
  table.appendLine("  import      %.2f s, %s; peak memory %.0f MB", inspection.loaded.importSeconds,
                   inspection.loaded.fromCache ? "from the cache" : "new",
                   inspection.peakMegabytes);
}

void addLargest(const scene::Scene& scene, TextTable& table) {
  std::vector<std::size_t> order(scene.solidObjects().size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto size = [&](std::size_t i) { return scene.staticBoxes()[i].size().norm(); };
  const std::size_t shown = std::min(kMaxListedObjects, order.size());
  std::partial_sort(
      order.begin(), order.begin() + static_cast<std::ptrdiff_t>(shown), order.end(),
      [&](std::size_t a, std::size_t b) { return size(a) != size(b) ? size(a) > size(b) : a < b; });
  if (shown > 0) table.appendLine("\nlargest objects");
  for (std::size_t i = 0; i < shown; ++i) {
    const Vec3 s = scene.staticBoxes()[order[i]].size();
    table.appendLine("  %9.2f x %8.2f x %8.2f m  %s", s.x(), s.y(), s.z(),
                     scene.model().objects[scene.solidObjects()[order[i]]].path.c_str());
  }
}

void addDiagnostics(const std::vector<InspectedDiagnostic>& problems, TextTable& table) {
  table.appendLine("\nproblems: %s", problems.empty() ? "none" : "");
  for (const InspectedDiagnostic& entry : problems) {
    const std::string_view meaning = entry.kind.meaning;
    table.appendLine("  %-7s %8zu  %-26s %s%.*s", toString(entry.kind.severity),
                     entry.diagnostic->count, entry.diagnostic->kind.c_str(),
                     entry.accepted ? "(accepted) " : "", static_cast<int>(meaning.size()),
                     meaning.data());
    table.appendLine("                    example: %s", entry.diagnostic->example.c_str());
  }
}

void addStoreys(const scene::Model& model, TextTable& table) {
  if (!model.storeys.empty()) table.appendLine("\nstoreys: elevation, objects, name");
  for (std::uint32_t i = 0; i < model.storeys.size(); ++i)
    table.appendLine("  %9.3f m  %6zu  %s", model.storeys[i].elevation, countObjects(model, i),
                     model.storeys[i].name.c_str());
  if (!model.spaces.empty())
    table.appendLine("  and %zu spaces: --json lists them", model.spaces.size());
}

void addClasses(const scene::Model& model, TextTable& table) {
  const std::vector<ClassCount> classes = countClasses(model);
  if (!classes.empty()) table.appendLine("\nobjects by class");
  for (const ClassCount& entry : classes)
    table.appendLine("  %8zu  %s", entry.objects, entry.name.c_str());
}

/// Appends the number of bodies per kind and the names of the first ones.
void addBodies(const scene::Model& model, TextTable& table) {
  table.appendLine("\nbodies: %s", model.bodies.empty() ? "none; all objects are static" : "");
  for (std::size_t i = 0; i < std::min(kMaxListedBodies, model.bodies.size()); ++i) {
    const scene::BodySpec& body = model.bodies[i];
    table.appendLine("  %-10s %-24s %s, from %s", toString(body.kind), body.name.c_str(),
                     model.objects[body.objects.front()].path.c_str(), toString(body.source));
  }
  if (model.bodies.size() > kMaxListedBodies)
    table.appendLine("  and %zu more: --json lists all", model.bodies.size() - kMaxListedBodies);
}

void addObjects(const scene::Scene& scene, TextTable& table) {
  table.appendLine("\nobjects: id, from, to, path");
  for (std::uint32_t i = 0; i < scene.model().objects.size(); ++i) {
    const std::string& path = scene.model().objects[i].path;
    const Aabb b = computeAuthoredAabb(scene, i);
    if (b.empty()) {
      table.appendLine("%8u  (not solid)  %s", i + 1, path.c_str());
    } else {
      table.appendLine("%8u  %.3f,%.3f,%.3f  %.3f,%.3f,%.3f  %s", i + 1, b.min.x(), b.min.y(),
                       b.min.z(), b.max.x(), b.max.y(), b.max.z(), path.c_str());
    }
  }
}

}  // namespace

Inspection makeInspection(LoadedScene loaded, const std::optional<scene::ModelCache>& cache) {
  Inspection inspection;
  inspection.report = loadOrMakeReport(*loaded.scene, cache);
  inspection.loaded = std::move(loaded);
  inspection.peakMegabytes =
      std::max(measurePeakMegabytes(RUSAGE_SELF), measurePeakMegabytes(RUSAGE_CHILDREN));
  return inspection;
}

std::vector<InspectedDiagnostic> listDiagnostics(const scene::SceneReport& report,
                                                 const std::vector<std::string>& accepted) {
  const auto accepts = [&](std::string_view word) {
    return std::find(accepted.begin(), accepted.end(), word) != accepted.end();
  };
  std::vector<InspectedDiagnostic> problems;
  for (const scene::Diagnostic& diagnostic : report.diagnostics) {
    const scene::DiagnosticKind kind = scene::findDiagnosticKind(diagnostic);
    const bool isWarning = kind.severity == scene::Severity::warning;
    problems.push_back(
        {&diagnostic, kind, accepts(diagnostic.kind) || (isWarning && accepts(kAllWarnings))});
  }
  std::stable_sort(problems.begin(), problems.end(),
                   [](const InspectedDiagnostic& a, const InspectedDiagnostic& b) {
                     return a.kind.severity > b.kind.severity;
                   });
  return problems;
}

std::size_t countObjects(const scene::Model& model, std::uint32_t storey) {
  return static_cast<std::size_t>(std::count_if(
      model.objects.begin(), model.objects.end(),
      [&](const scene::Object& object) { return object.storey == storey && !object.partOf; }));
}

std::vector<ClassCount> countClasses(const scene::Model& model,
                                     std::optional<std::uint32_t> storey) {
  std::map<std::string, std::size_t> counts;
  for (const scene::Object& object : model.objects) {
    const bool isCounted = !storey || object.storey == storey;
    if (isCounted && !object.ifcClass.empty() && !object.partOf) ++counts[object.ifcClass];
  }
  std::vector<ClassCount> classes;
  for (const auto& [name, objects] : counts) classes.push_back({name, objects});
  std::stable_sort(classes.begin(), classes.end(),
                   [](const ClassCount& a, const ClassCount& b) { return a.objects > b.objects; });
  return classes;
}

std::string formatInspectionJson(const Inspection& inspection,
                                 const std::vector<std::string>& accepted, bool objects) {
  const scene::Scene& scene = *inspection.loaded.scene;
  const scene::Model& model = scene.model();
  const scene::SceneReport& report = inspection.report;
  Json all;
  all["source"] = model.source;
  all["reader"] = model.reader;
  all["objects"] = report.objects;
  all["solid_objects"] = report.solidObjects;
  all["meshes"] = report.meshes;
  all["triangles"] = report.triangles;
  all["unique_triangles"] = report.uniqueTriangles;
  all["unique_positions"] = report.uniquePositions;
  all["bounds"] = toJson(scene.bounds());
  all["unit"] = model.metresPerUnit;
  all["up"] = toString(model.upAxis);
  all["offset"] = toJson(model.offset);
  all["map"] = model.map;
  all["north"] = northToJson(model.north);
  all["scenes"] = {{"names", model.fileScenes}, {"read", model.fileScene}};
  all["convex_parts"] = report.shells.exact + report.shells.nearlyConvex;
  all["convex_triangles"] = report.hullTriangles;
  all["triangle_parts"] = report.partTriangles;
  all["shells"] = toJson(report.shells);
  all["classes"] = toJson(countClasses(model));
  all["storeys"] = storeysToJson(model);
  all["spaces"] = spacesToJson(model);
  all["bodies"] = bodiesToJson(model);
  all["problems"] = toJson(listDiagnostics(report, accepted));
  all["import_seconds"] = inspection.loaded.importSeconds;
  all["load_seconds"] = inspection.loaded.loadSeconds;
  all["from_cache"] = inspection.loaded.fromCache;
  all["peak_mb"] = inspection.peakMegabytes;
  if (objects) all["object_list"] = objectsToJson(scene);
  return all.dump(2, ' ', false, Json::error_handler_t::replace);
}

std::string formatInspectionTable(const Inspection& inspection,
                                  const std::vector<std::string>& accepted, bool objects) {
  TextTable table;
  addSummary(inspection, table);
  addLargest(*inspection.loaded.scene, table);
  addBodies(inspection.loaded.scene->model(), table);
  addStoreys(inspection.loaded.scene->model(), table);
  addClasses(inspection.loaded.scene->model(), table);
  addDiagnostics(listDiagnostics(inspection.report, accepted), table);
  if (objects) addObjects(*inspection.loaded.scene, table);
  return table.release();
}

}  // namespace enfilade::server
