#include "server/commands/inspection.hpp"

#include <sys/resource.h>

#include <algorithm>
#include <cstdarg>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <numeric>

#include "scene/model/diagnostic_catalog.hpp"
#include "server/commands/report_cache.hpp"

namespace enfilade::server {
namespace {

using json = nlohmann::ordered_json;
using scene::Box;
using scene::Vec3;

constexpr std::size_t kLargest = 5;  // objects that the table names
constexpr std::size_t kBodies = 12;  // bodies that the table names

double megabytes(int who) {
  rusage usage{};
  getrusage(who, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

// ---- JSON ---------------------------------------------------------------------------------------

json jsonOf(const Vec3& v) {
  return json::array({v.x(), v.y(), v.z()});
}

json jsonOf(const Box& box) {
  if (box.empty()) return nullptr;
  return {{"min", jsonOf(box.min)}, {"max", jsonOf(box.max)}, {"size", jsonOf(box.size())}};
}

json jsonOf(const scene::ShellCounts& shells) {
  return {{"convex_exact", shells.exact}, {"convex_rounded", shells.rounded},
          {"hollow", shells.hollow},      {"inward", shells.inward},
          {"closed", shells.closed},      {"open", shells.open}};
}

json problemsOf(const scene::SceneReport& report) {
  json list = json::array();
  for (const scene::Problem& p : report.problems) {
    const scene::ProblemKind kind = scene::kindOf(p);
    list.push_back({{"kind", p.kind},
                    {"count", p.count},
                    {"example", p.example},
                    {"note", kind.note},
                    {"meaning", kind.meaning}});
  }
  return list;
}

json objectsOf(const scene::Scene& scene) {
  json list = json::array();
  for (std::uint32_t i = 0; i < scene.model().objects.size(); ++i) {
    const scene::Object& object = scene.model().objects[i];
    json entry{{"id", i + 1}, {"path", object.path}, {"box", jsonOf(boxOf(scene, i))}};
    if (!object.globalId.empty()) entry["global_id"] = object.globalId;
    if (!object.ifcClass.empty()) entry["class"] = object.ifcClass;
    if (!object.operation.empty()) entry["operation"] = object.operation;
    if (object.pieceOf) entry["piece_of"] = *object.pieceOf + 1;
    if (object.use != scene::Object::Use::whole)
      entry["only"] = object.use == scene::Object::Use::drawn ? "drawn" : "solid";
    list.push_back(std::move(entry));
  }
  return list;
}

/// Where it is, how far it goes: what depends on the kind is there only for that kind.
json jsonOf(const scene::Model& model, const scene::BodySpec& body) {
  json objects = json::array();
  for (const std::uint32_t object : body.objects) objects.push_back(model.objects[object].path);
  json entry{{"name", body.name},
             {"kind", wordOf(body.kind)},
             {"source", wordOf(body.source)},
             {"objects", std::move(objects)},
             {"anchor", jsonOf(body.anchor)},
             {"axis", jsonOf(body.axis)}};
  using scene::BodyKind;
  const bool limited = body.kind == BodyKind::hinged || body.kind == BodyKind::sliding ||
                       body.kind == BodyKind::lift;
  if (limited) {
    entry["low"] = body.low;
    entry["high"] = body.high;
    entry["speed"] = body.speed;
  }
  if (body.kind == BodyKind::lift) entry["stops"] = body.stops;
  if (body.kind == BodyKind::path) {
    entry["seconds"] = body.keys.back().time;
    entry["speed"] = body.speed;
    entry["loops"] = body.loops;
    entry["runs"] = body.runs;
    for (const scene::PathKey& key : body.keys)
      entry["keys"].push_back(
          {{"time", key.time}, {"offset", jsonOf(key.offset)}, {"turn", key.turn}});
  }
  if (body.kind == BodyKind::rigid) {
    if (body.mass)
      entry["mass"] = *body.mass;
    else
      entry["density"] = body.density;
  }
  return entry;
}

json bodiesOf(const scene::Model& model) {
  json list = json::array();
  for (const scene::BodySpec& body : model.bodies) list.push_back(jsonOf(model, body));
  return list;
}

// ---- table --------------------------------------------------------------------------------------

class Table {
 public:
  __attribute__((format(printf, 2, 3))) void line(const char* format, ...) {
    std::va_list arguments;
    va_start(arguments, format);
    std::va_list again;
    va_copy(again, arguments);
    std::string text(static_cast<std::size_t>(std::vsnprintf(nullptr, 0, format, arguments)) + 1,
                     '\0');
    std::vsnprintf(text.data(), text.size(), format, again);
    va_end(again);
    va_end(arguments);
    text.back() = '\n';
    text_ += text;
  }
  std::string take() { return std::move(text_); }

 private:
  std::string text_;
};

void addSummary(const Inspection& inspection, Table& table) {
  const scene::Scene& scene = *inspection.loaded.scene;
  const scene::Model& model = scene.model();
  const scene::SceneReport& report = inspection.report;
  const Vec3 low = scene.bounds().empty() ? Vec3::Zero().eval() : scene.bounds().min;
  const Vec3 high = scene.bounds().empty() ? Vec3::Zero().eval() : scene.bounds().max;
  table.line("%s", model.source.c_str());
  if (!model.reader.empty()) table.line("  read by     %s", model.reader.c_str());
  table.line("  size        %.3f x %.3f x %.3f m", high.x() - low.x(), high.y() - low.y(),
             high.z() - low.z());
  table.line("  from        %.3f, %.3f, %.3f", low.x(), low.y(), low.z());
  table.line("  to          %.3f, %.3f, %.3f", high.x(), high.y(), high.z());
  table.line("  unit        %g m; up in the file: %c", model.metresPerUnit, model.up);
  table.line("  offset      %.3f, %.3f, %.3f m taken off the file's coordinates", model.offset.x(),
             model.offset.y(), model.offset.z());
  table.line("  objects     %zu, of which %zu can be touched; %zu meshes", report.objects,
             report.solidObjects, report.meshes);
  table.line("  triangles   %zu; %zu in the meshes", report.triangles, report.uniqueTriangles);
  const std::size_t convex = report.shells.exact + report.shells.rounded;
  table.line("  convex      %zu parts are one hull each: %zu exactly, %zu up to rounding", convex,
             report.shells.exact, report.shells.rounded);
  table.line("              they stand for %zu triangles; %zu stay triangles", report.hullTriangles,
             report.partTriangles);
  table.line("  the rest    %zu closed pieces, %zu open, %zu around a cavity, %zu seen from within",
             report.shells.closed, report.shells.open, report.shells.hollow, report.shells.inward);
  table.line("  import      %.2f s, %s; %.0f MB at most", inspection.loaded.importSeconds,
             inspection.loaded.fromCache ? "kept from an earlier start" : "just now",
             inspection.peakMegabytes);
}

void addLargest(const scene::Scene& scene, Table& table) {
  std::vector<std::size_t> order(scene.solidObjects().size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto size = [&](std::size_t i) { return scene.stillBoxes()[i].size().norm(); };
  const std::size_t shown = std::min(kLargest, order.size());
  std::partial_sort(
      order.begin(), order.begin() + static_cast<std::ptrdiff_t>(shown), order.end(),
      [&](std::size_t a, std::size_t b) { return size(a) != size(b) ? size(a) > size(b) : a < b; });
  if (shown > 0) table.line("\nlargest objects");
  for (std::size_t i = 0; i < shown; ++i) {
    const Vec3 s = scene.stillBoxes()[order[i]].size();
    table.line("  %9.2f x %8.2f x %8.2f m  %s", s.x(), s.y(), s.z(),
               scene.model().objects[scene.solidObjects()[order[i]]].path.c_str());
  }
}

void addProblems(const scene::SceneReport& report, Table& table) {
  table.line("\nproblems: %s", report.problems.empty() ? "none" : "");
  for (const scene::Problem& p : report.problems) {
    const scene::ProblemKind kind = scene::kindOf(p);
    table.line("  %8zu  %-26s %s%.*s", p.count, p.kind.c_str(), kind.note ? "(all right) " : "",
               static_cast<int>(kind.meaning.size()), kind.meaning.data());
    table.line("            as %s", p.example.c_str());
  }
}

/// How many of each kind, and the first ones by name.
void addBodies(const scene::Model& model, Table& table) {
  table.line("\nbodies: %s", model.bodies.empty() ? "none; everything stands still" : "");
  for (std::size_t i = 0; i < std::min(kBodies, model.bodies.size()); ++i) {
    const scene::BodySpec& body = model.bodies[i];
    table.line("  %-10s %-24s %s, from %s", wordOf(body.kind), body.name.c_str(),
               model.objects[body.objects.front()].path.c_str(), wordOf(body.source));
  }
  if (model.bodies.size() > kBodies)
    table.line("  and %zu more: --json tells them all", model.bodies.size() - kBodies);
}

void addObjects(const scene::Scene& scene, Table& table) {
  table.line("\nobjects: id, from, to, path");
  for (std::uint32_t i = 0; i < scene.model().objects.size(); ++i) {
    const std::string& path = scene.model().objects[i].path;
    const Box b = boxOf(scene, i);
    if (b.empty()) {
      table.line("%8u  (nothing to touch)  %s", i + 1, path.c_str());
    } else {
      table.line("%8u  %.3f,%.3f,%.3f  %.3f,%.3f,%.3f  %s", i + 1, b.min.x(), b.min.y(), b.min.z(),
                 b.max.x(), b.max.y(), b.max.z(), path.c_str());
    }
  }
}

}  // namespace

Inspection inspected(LoadedScene loaded, const std::optional<scene::ModelCache>& cache) {
  Inspection inspection;
  inspection.report = reportFor(*loaded.scene, cache);
  inspection.loaded = std::move(loaded);
  inspection.peakMegabytes = std::max(megabytes(RUSAGE_SELF), megabytes(RUSAGE_CHILDREN));
  return inspection;
}

std::string inspectionJson(const Inspection& inspection, bool objects) {
  const scene::Scene& scene = *inspection.loaded.scene;
  const scene::Model& model = scene.model();
  const scene::SceneReport& report = inspection.report;
  json all;
  all["source"] = model.source;
  all["reader"] = model.reader;
  all["objects"] = report.objects;
  all["solid_objects"] = report.solidObjects;
  all["meshes"] = report.meshes;
  all["triangles"] = report.triangles;
  all["unique_triangles"] = report.uniqueTriangles;
  all["unique_positions"] = report.uniquePositions;
  all["bounds"] = jsonOf(scene.bounds());
  all["unit"] = model.metresPerUnit;
  all["up"] = std::string(1, model.up);
  all["offset"] = jsonOf(model.offset);
  all["convex_parts"] = report.shells.exact + report.shells.rounded;
  all["convex_triangles"] = report.hullTriangles;
  all["triangle_parts"] = report.partTriangles;
  all["shells"] = jsonOf(report.shells);
  all["bodies"] = bodiesOf(model);
  all["problems"] = problemsOf(report);
  all["import_seconds"] = inspection.loaded.importSeconds;
  all["load_seconds"] = inspection.loaded.loadSeconds;
  all["from_cache"] = inspection.loaded.fromCache;
  all["peak_mb"] = inspection.peakMegabytes;
  if (objects) all["object_list"] = objectsOf(scene);
  return all.dump(2, ' ', false, json::error_handler_t::replace);
}

std::string inspectionTable(const Inspection& inspection, bool objects) {
  Table table;
  addSummary(inspection, table);
  addLargest(*inspection.loaded.scene, table);
  addBodies(inspection.loaded.scene->model(), table);
  addProblems(inspection.report, table);
  if (objects) addObjects(*inspection.loaded.scene, table);
  return table.take();
}

}  // namespace enfilade::server
