#include "server/plans/floor_plans.hpp"

#include <algorithm>
#include <array>
#include <cstdio>

#include "server/floors/floor_plan.hpp"
#include "server/plans/plan_drawing.hpp"
#include "server/plans/space_names.hpp"

namespace enfilade::server {
namespace {

using render::Canvas;
using render::Image;
using render::TextStyle;
using scene::Aabb;

constexpr double kMargin = 2.0;                        // metres around the section
constexpr double kMaxWidth = 1600, kMaxHeight = 1200;  // pixels of the plan
constexpr double kPointsPerMetre = 72 / 0.0254;        // of a page
constexpr double kPageUnit = 0.7;                      // points of a thin line

/// The plan shows the bounds of the section and of the rooms, without lawns and roofs; the scene,
/// if the storey has neither.
Aabb computePlanArea(const scene::Scene& scene, const FloorPlan& plan) {
  Aabb area;
  for (const PlanShape& shape : plan.shapes) {
    if (shape.kind != PlanShape::Kind::wall && shape.kind != PlanShape::Kind::furniture) continue;
    for (const auto* lines : {&shape.loops, &shape.lines})
      for (const auto& line : *lines)
        for (const Vec3& point : line) area.include(point);
  }
  for (const scene::Space& room : plan.rooms) area.include(room.box);
  if (area.empty()) area = scene.bounds();
  Aabb drawn = collision::inflate(area, kMargin);
  drawn.min.y() = std::min(drawn.min.y(), scene.bounds().min.y());
  drawn.max.y() = std::max(drawn.max.y(), scene.bounds().max.y());
  return drawn;
}

/// Space around a plan, thin lines: numbers left and below, scale bar below these.
constexpr double kLeft = 64, kRight = 24, kBottom = 82;
constexpr double kMinWidth = 560;  // thin lines, of a sheet

std::string formatTitle(const scene::Scene& scene, const FloorPlan& plan) {
  const std::string& source = scene.model().source;
  const std::string file = source.substr(source.find_last_of('/') + 1);
  return plan.storey.empty() ? file : file + ": " + plan.storey;
}

std::string formatNote(const FloorPlan& plan, const std::string& scale) {
  return formatFloorAndCut(plan.floor) + (scale.empty() ? "" : ", " + scale) +
         "; metres of the scene; facing 0 looks right (+x), 90 up (-z)";
}

/// A plan with its heading, names of rooms and scale bar; their places are known before the canvas.
class PlanSheet {
 public:
  PlanSheet(const scene::Scene& scene, const FloorPlan& plan, const render::Camera& camera,
            double unitsPerMetre, double unit, const std::string& scale)
      : width_(std::max(kMinWidth * unit, (kLeft + kRight) * unit + camera.width * unitsPerMetre *
                                                                        camera.heightY /
                                                                        camera.height)),
        heading_(makePlanHeading(formatTitle(scene, plan), formatNote(plan, scale), width_, unit)),
        view_(
            makePlanView(camera, plan.floor, {kLeft * unit, heading_.height}, unitsPerMetre, unit)),
        names_(view_.box(), unit, entries_) {
    placeSpaceNames(names_, Canvas(1, 1, kPlanPaper), view_, plan.rooms);
  }

  double width() const { return width_; }
  double height() const {
    return view_.topLeft.y + view_.height() + kBottom * view_.unit +
           measureEntries(entries_, computeEntriesWidth(), view_.unit);
  }

  void draw(Canvas& canvas, const FloorPlan& plan, const PlanPicture& picture) const {
    drawPlanPicture(canvas, view_, picture);
    drawGrid(canvas, view_);
    drawFloorPlan(canvas, view_, plan);
    names_.drawLeaders(canvas);
    names_.drawTexts(canvas);
    const double below = view_.topLeft.y + view_.height();
    drawScaleBar(canvas, view_, {view_.topLeft.x, below + 42 * view_.unit}, plan.north);
    drawEntries(canvas, entries_, {view_.topLeft.x, below + (kBottom - 4) * view_.unit},
                computeEntriesWidth(), view_.unit);
    drawPlanHeading(canvas, heading_, view_.unit);
    reportMissingFont(canvas);
  }

 private:
  double computeEntriesWidth() const { return width_ - (kLeft + kRight) * view_.unit; }

  double width_;
  PlanHeading heading_;
  PlanView view_;
  std::vector<CaptionEntry> entries_;  ///< names of rooms that have no space for them
  CaptionList names_;
};

}  // namespace

std::optional<Image> drawStoreyPlan(const scene::Scene& scene, const StoreyFloor& storey,
                                    const PlanRenderer& renderPlan) {
  const FloorPlan plan = computeFloorPlan(scene, storey);
  const render::Camera camera =
      makePlanCamera(computePlanArea(scene, plan), plan.floor, kMaxWidth, kMaxHeight);
  const std::optional<PlanPicture> picture = renderPlan(camera);
  if (!picture) return std::nullopt;
  const PlanSheet sheet(scene, plan, camera, camera.height / camera.heightY, 1, "");
  Canvas canvas(static_cast<int>(sheet.width()), static_cast<int>(sheet.height()), kPlanPaper);
  sheet.draw(canvas, plan, *picture);
  return canvas.toImage();
}

bool writeStoreyPage(const scene::Scene& scene, const StoreyFloor& storey,
                     const PlanRenderer& renderPlan, double scale,
                     const std::filesystem::path& file) {
  const FloorPlan plan = computeFloorPlan(scene, storey);
  const render::Camera camera =
      makePlanCamera(computePlanArea(scene, plan), plan.floor, 2 * kMaxWidth, 2 * kMaxHeight);
  const std::optional<PlanPicture> picture = renderPlan(camera);
  if (!picture) return false;
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "scale 1:%.10g", scale);
  const PlanSheet sheet(scene, plan, camera, kPointsPerMetre / scale, kPageUnit, text.data());
  Canvas canvas(file, sheet.width(), sheet.height(), {255, 255, 255});
  sheet.draw(canvas, plan, *picture);
  canvas.finish();
  return true;
}

}  // namespace enfilade::server
