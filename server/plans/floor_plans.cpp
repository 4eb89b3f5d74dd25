#include "server/plans/floor_plans.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>

#include "server/plans/floor_plan_section.hpp"

namespace enfilade::server {
namespace {

using render::Image;
using scene::Aabb;

constexpr double kMinFloorNormalY = 0.94;  // minimum y of a floor's normal: within 20 degrees
constexpr double kMinFloorArea = 0.5;      // square metres: minimum floor area of an object
constexpr double kMinStoreyShare = 0.04;   // minimum share of all floor area for a storey
constexpr std::size_t kMaxStoreys = 12;
constexpr double kWallBottom = 0.3, kWallTop = 1.5;  // metres above a floor that a wall spans
constexpr double kMaxNameDistance = 0.6;  // metres between a storey's floor and its objects
constexpr double kMargin = 2.0;           // metres around the section
constexpr double kMaxWidth = 1600, kMaxHeight = 1200;            // pixels of the plan
constexpr int kLeft = 84, kTop = 64, kRight = 24, kBottom = 84;  // pixels of the frame around it
constexpr double kMinLabelSpacing = 80;  // minimum spacing of the frame's numbers
constexpr render::Colour kGrid{214, 218, 228}, kAxis{180, 60, 40};

// ---- storeys ------------------------------------------------------------------------------------

/// Adds the upward faces of an object, weighted by their projected area. For open shells both sides
/// count, because their orientation is unknown.
void addFloors(const scene::Scene& scene, std::uint32_t object,
               std::vector<WeightedHeight>& heights) {
  const scene::Shape& shape = scene.shape(object);
  const Eigen::Affine3d& worldFromMesh = scene.model().objects[object].worldFromMesh;
  const double mirror = worldFromMesh.linear().determinant() < 0 ? -1 : 1;
  for (const scene::Shell& shell : shape.shells) {
    const double outside = shell.inward ? -mirror : mirror;
    for (std::size_t t = shell.first; t < shell.first + shell.count; ++t) {
      std::array<Vec3, 3> p;
      for (std::size_t k = 0; k < 3; ++k)
        p[k] = worldFromMesh * shape.vertices[shape.triangles[t][k]].cast<double>();
      const Vec3 normal = outside * (p[1] - p[0]).cross(p[2] - p[0]);
      const double up = shell.bounds() ? normal.y() : std::abs(normal.y());
      if (up > kMinFloorNormalY * normal.norm())
        heights.push_back({(p[0].y() + p[1].y() + p[2].y()) / 3, 0.5 * up});
    }
  }
}

bool hasWallsAbove(const scene::Scene& scene, double floor) {
  return std::any_of(scene.staticBoxes().begin(), scene.staticBoxes().end(), [&](const Aabb& box) {
    return box.min.y() <= floor + kWallBottom && box.max.y() >= floor + kWallTop;
  });
}

/// Parses the storey name from an object path: the text between `Ifc...Storey` and the next '/'.
std::string parseStoreyName(const std::string& path) {
  const std::size_t word = path.find("IfcBuildingStorey");
  if (word == std::string::npos) return "";
  std::string name = path.substr(word + 17, path.find('/', word) - word - 17);
  while (!name.empty() && (name.front() == '_' || name.front() == ':')) name.erase(0, 1);
  // Some IFC readers append the GlobalId.
  if (name.size() > 23 && name[name.size() - 23] == '_') name.resize(name.size() - 23);
  return name;
}

/// Finds the storey name of most objects on this floor.
std::string findStoreyName(const scene::Scene& scene, double floor) {
  std::map<std::string, std::size_t> names;
  for (std::size_t i = 0; i < scene.solidObjects().size(); ++i) {
    if (std::abs(scene.staticBoxes()[i].min.y() - floor) > kMaxNameDistance) continue;
    const std::string name = parseStoreyName(scene.model().objects[scene.solidObjects()[i]].path);
    if (!name.empty()) ++names[name];
  }
  const auto mostFrequent = std::max_element(
      names.begin(), names.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  return mostFrequent == names.end() ? "" : mostFrequent->first;
}

// ---- the picture --------------------------------------------------------------------------------

/// A plan with its frame, and the mapping from metres to pixels.
struct Sheet {
  render::Camera camera;
  Image image;

  double x(double metres) const {
    return kLeft + render::project(camera, {metres, camera.eye.y(), camera.eye.z()}).x();
  }
  double y(double metres) const {
    return kTop + render::project(camera, {camera.eye.x(), camera.eye.y(), metres}).y();
  }
  double pixelsPerMetre() const { return camera.height / camera.heightY; }
};

/// Chooses a grid step of 1, 2 or 5 times a power of ten metres with enough space for labels.
double chooseGridStep(double pixelsPerMetre) {
  double step = 0.01;
  for (int i = 0; i < 60; ++i) {  // up to 10^18 m
    if (step * pixelsPerMetre >= kMinLabelSpacing) return step;
    step *= i % 3 == 1 ? 2.5 : 2;
  }
  return step;
}

std::string formatNumber(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.10g", value);
  return text.data();
}

void drawGridLineX(Sheet& sheet, double metres, double step) {
  const double x = sheet.x(metres);
  const int bottom = kTop + sheet.camera.height;
  const bool axis = std::abs(metres) < 0.5 * step;
  render::drawLine(sheet.image, x, kTop, x, bottom, 1, axis ? kAxis : kGrid);
  const std::string text = formatNumber(axis ? 0 : metres);
  render::drawText(sheet.image, static_cast<int>(x) - 6 * static_cast<int>(text.size()), bottom + 8,
                   text, 2, kPlanInk);
}

void drawGridLineZ(Sheet& sheet, double metres, double step) {
  const double y = sheet.y(metres);
  const bool axis = std::abs(metres) < 0.5 * step;
  render::drawLine(sheet.image, kLeft, y, kLeft + sheet.camera.width, y, 1, axis ? kAxis : kGrid);
  const std::string text = formatNumber(axis ? 0 : metres);
  render::drawText(sheet.image, kLeft - 8 - 12 * static_cast<int>(text.size()),
                   static_cast<int>(y) - 8, text, 2, kPlanInk);
}

/// The plan shows the bounds of the section, without lawns and roofs; without a section, the scene.
Aabb computePlanArea(const scene::Scene& scene, const std::vector<SectionLine>& section) {
  Aabb area;
  for (const SectionLine& line : section) {
    area.include(line.from);
    area.include(line.to);
  }
  if (section.empty()) area = scene.bounds();
  Aabb drawn = collision::inflated(area, kMargin);
  drawn.min.y() = std::min(drawn.min.y(), scene.bounds().min.y());
  drawn.max.y() = std::max(drawn.max.y(), scene.bounds().max.y());
  return drawn;
}

/// Draws grid lines with coordinates. The axes have their own colour.
void drawGrid(Sheet& sheet) {
  const double step = chooseGridStep(sheet.pixelsPerMetre());
  const double left = sheet.camera.eye.x() - 0.5 * sheet.camera.width / sheet.pixelsPerMetre();
  const double top = sheet.camera.eye.z() - 0.5 * sheet.camera.heightY;
  const double right = 2 * sheet.camera.eye.x() - left, bottom = 2 * sheet.camera.eye.z() - top;
  for (double k = std::ceil(left / step); k * step <= right; ++k)
    drawGridLineX(sheet, k * step, step);
  for (double k = std::ceil(top / step); k * step <= bottom; ++k)
    drawGridLineZ(sheet, k * step, step);
}

void drawFrame(Sheet& sheet) {
  const double right = kLeft + sheet.camera.width, bottom = kTop + sheet.camera.height;
  const std::array<std::array<double, 4>, 4> sides{{{kLeft, kTop, right, kTop},
                                                    {kLeft, bottom, right, bottom},
                                                    {kLeft, kTop, kLeft, bottom},
                                                    {right, kTop, right, bottom}}};
  for (const auto& s : sides) render::drawLine(sheet.image, s[0], s[1], s[2], s[3], 2, kPlanInk);
  render::drawText(sheet.image, static_cast<int>(right) - 24, static_cast<int>(bottom) + 30, "x >",
                   2, kAxis);
  render::drawText(sheet.image, 8, static_cast<int>(bottom) - 16, "z v", 2, kAxis);
}

void drawScale(Sheet& sheet) {
  const double step = chooseGridStep(sheet.pixelsPerMetre());
  const double y = kTop + sheet.camera.height + 44, end = kLeft + step * sheet.pixelsPerMetre();
  render::drawLine(sheet.image, kLeft, y, end, y, 3, kPlanInk);
  for (const double x : {static_cast<double>(kLeft), end})
    render::drawLine(sheet.image, x, y - 6, x, y + 6, 3, kPlanInk);
  render::drawText(sheet.image, static_cast<int>(end) + 12, static_cast<int>(y) - 8,
                   formatNumber(step) + " m", 2, kPlanInk);
}

void drawTitle(Sheet& sheet, const scene::Scene& scene, const StoreyFloor& storey) {
  const std::string& source = scene.model().source;
  std::array<char, 96> text{};
  std::snprintf(text.data(), text.size(), "floor at y = %.2f m, cut %.1f m above", storey.height,
                kPlanCutHeight);
  const std::string name = storey.name.empty() ? "" : storey.name + ", ";
  render::drawText(sheet.image, 16, 12,
                   source.substr(source.find_last_of('/') + 1) + ": " + name + text.data(), 2,
                   kPlanInk);
  render::drawText(sheet.image, 16, 36,
                   "metres of the scene; facing 0 looks right (+x), 90 up (-z)", 2, kPlanInk);
}

}  // namespace

std::vector<StoreyFloor> findStoreys(const scene::Scene& scene) {
  std::vector<WeightedHeight> heights;
  for (std::size_t i = 0; i < scene.solidObjects().size(); ++i) {
    const Vec3 size = scene.staticBoxes()[i].size();
    if (size.x() * size.z() >= kMinFloorArea) addFloors(scene, scene.solidObjects()[i], heights);
  }
  std::vector<StoreyFloor> storeys;
  for (const double height : findStoreyHeights(heights, kMinStoreyShare, kMaxStoreys)) {
    if (hasWallsAbove(scene, height)) storeys.push_back({height, findStoreyName(scene, height)});
  }
  if (storeys.empty() && !scene.bounds().empty()) storeys.push_back({scene.bounds().min.y(), ""});
  return storeys;
}

std::optional<Image> drawStoreyPlan(const scene::Scene& scene, const StoreyFloor& storey,
                                    const PlanRenderer& renderPlan) {
  Sheet sheet;
  const std::vector<SectionLine> section = cutScene(scene, storey.height + kPlanCutHeight);
  sheet.camera =
      makePlanCamera(computePlanArea(scene, section), storey.height, kMaxWidth, kMaxHeight);
  const std::optional<PlanPicture> plan = renderPlan(sheet.camera);
  if (!plan) return std::nullopt;
  sheet.image = render::makeBlankImage(std::max(720, kLeft + sheet.camera.width + kRight),
                                       kTop + sheet.camera.height + kBottom, kPlanPaper);
  render::paste(sheet.image, makePlanBackground(*plan), kLeft, kTop);
  drawGrid(sheet);
  drawSection(sheet.image, sheet.camera, section, kLeft, kTop);
  drawFrame(sheet);
  drawScale(sheet);
  drawTitle(sheet, scene, storey);
  return std::move(sheet.image);
}

}  // namespace enfilade::server
