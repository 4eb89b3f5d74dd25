#include "server/inspection/inspection_html.hpp"

#include <fmt/core.h>

#include <algorithm>

#include "scene/model/diagnostic_catalog.hpp"
#include "scene/model/format_number.hpp"
#include "server/base/version.hpp"
#include "server/inspection/html_page.hpp"

namespace enfilade::server {
namespace {

using Row = std::vector<HtmlCell>;
using Vec3 = scene::Vec3;

std::string describeNorth(const std::optional<Eigen::Vector2d>& north) {
  if (!north) return "unknown";
  return fmt::format("x {:.6f}, z {:.6f}", north->x(), north->y());
}

void addFacts(const Inspection& inspection, HtmlPage& page) {
  const scene::Scene& scene = *inspection.loaded.scene;
  const scene::SceneReport& report = inspection.report;
  const Vec3 size = scene.bounds().empty() ? Vec3::Zero().eval() : scene.bounds().size();
  const std::size_t convex = report.shells.exact + report.shells.nearlyConvex;
  page.addFacts(
      {{"Size", fmt::format("{:.2f} × {:.2f} × {:.2f} m (y is up)", size.x(), size.y(), size.z())},
       {"Unit, up axis",
        fmt::format("{} m, {}", scene.model().metresPerUnit, toString(scene.model().upAxis))},
       {"Subtracted from the file", scene::formatPoint(scene.model().offset) + " m"},
       {"Objects", fmt::format("{}, of which {} are solid", report.objects, report.solidObjects)},
       {"Meshes", fmt::format("{}", report.meshes)},
       {"Triangles", fmt::format("{}; {} in the meshes", report.triangles, report.uniqueTriangles)},
       {"Collision", fmt::format("{} convex parts replace {} triangles; {} triangles remain",
                                 convex, report.hullTriangles, report.partTriangles)},
       {"Import", fmt::format("{:.2f} s", inspection.loaded.importSeconds)},
       {"North", describeNorth(scene.model().north)}});
}

void addDiagnostics(const Inspection& inspection, const std::vector<std::string>& accepted,
                    HtmlPage& page) {
  page.addHeading("Problems");
  std::vector<Row> rows;
  for (const InspectedDiagnostic& entry : listDiagnostics(inspection.report, accepted))
    rows.push_back({{toString(entry.kind.severity), toString(entry.kind.severity)},
                    {fmt::format("{}", entry.diagnostic->count), "number"},
                    {entry.diagnostic->kind + (entry.accepted ? " (accepted)" : ""), "name"},
                    {std::string(entry.kind.meaning)},
                    {entry.diagnostic->example}});
  if (rows.empty()) return page.addParagraph("None.");
  page.addTable({{"Severity"}, {"Count", "number"}, {"Kind"}, {"Meaning"}, {"Example"}}, rows);
}

void addClasses(const scene::Model& model, HtmlPage& page) {
  const std::vector<ClassCount> classes = countClasses(model);
  if (classes.empty()) return;
  page.addHeading("Objects by class");
  std::vector<Row> rows;
  for (const ClassCount& entry : classes)
    rows.push_back({{entry.name}, {fmt::format("{}", entry.objects), "number"}});
  page.addTable({{"Class"}, {"Objects", "number"}}, rows);
}

/// One row per class, one column per storey that has objects.
void addStoreys(const scene::Model& model, HtmlPage& page) {
  std::vector<std::uint32_t> used;
  for (std::uint32_t i = 0; i < model.storeys.size(); ++i)
    if (countObjects(model, i) > 0) used.push_back(i);
  if (used.empty()) return addClasses(model, page);
  page.addHeading("Objects by class and storey");
  Row header{{"Class"}};
  for (const std::uint32_t storey : used)
    header.push_back(
        {fmt::format("{} ({:.2f} m)", model.storeys[storey].name, model.storeys[storey].elevation),
         "number"});
  header.push_back({"All", "number"});
  std::vector<Row> rows;
  for (const ClassCount& all : countClasses(model)) {
    Row row{{all.name}};
    for (const std::uint32_t storey : used) {
      std::string count;
      for (const ClassCount& one : countClasses(model, storey))
        if (one.name == all.name) count = std::to_string(one.objects);
      row.push_back({count, "number"});
    }
    row.push_back({std::to_string(all.objects), "number"});
    rows.push_back(std::move(row));
  }
  page.addTable(header, rows);
}

void addSpaces(const scene::Model& model, HtmlPage& page) {
  if (model.spaces.empty()) return;
  page.addHeading("Spaces");
  std::vector<Row> rows;
  for (const scene::Space& space : model.spaces) {
    const auto size = space.box.empty() ? scene::Vec3::Zero().eval() : space.box.size();
    rows.push_back({{space.name},
                    {space.longName},
                    {space.storey ? model.storeys[*space.storey].name : ""},
                    {space.box.empty()
                         ? ""
                         : fmt::format("{:.2f} × {:.2f} × {:.2f} m", size.x(), size.z(), size.y()),
                     "number"}});
  }
  page.addTable({{"Number"}, {"Name"}, {"Storey"}, {"Extent, height", "number"}}, rows);
}

void addBodies(const scene::Model& model, HtmlPage& page) {
  page.addHeading("Moving bodies");
  if (model.bodies.empty()) return page.addParagraph("None; all objects are static.");
  std::vector<Row> rows;
  for (const scene::BodySpec& body : model.bodies)
    rows.push_back({{body.name},
                    {toString(body.kind)},
                    {toString(body.source)},
                    {model.objects[body.objects.front()].path}});
  page.addTable({{"Name"}, {"Kind"}, {"Source"}, {"Object"}}, rows);
}

void addPlans(const std::vector<StoreyPlan>& plans, HtmlPage& page) {
  if (plans.empty()) return;
  page.addHeading("Floor plans");
  for (const StoreyPlan& plan : plans) page.addImage(plan.image, plan.caption);
}

}  // namespace

std::string formatInspectionHtml(const Inspection& inspection,
                                 const std::vector<std::string>& accepted,
                                 const std::vector<StoreyPlan>& plans) {
  const scene::Model& model = inspection.loaded.scene->model();
  const std::string file = model.source.substr(model.source.find_last_of('/') + 1);
  const std::string reader = model.reader.empty() ? "" : "read by " + model.reader + "; ";
  HtmlPage page(file, reader + "report by " + formatVersion());
  addFacts(inspection, page);
  addDiagnostics(inspection, accepted, page);
  addPlans(plans, page);
  addStoreys(model, page);
  addSpaces(model, page);
  addBodies(model, page);
  return page.finish();
}

}  // namespace enfilade::server
