// Draws a floor plan on a canvas. It has the picture from above, walls cut and filled, doors with
// their swing, a grid with coordinates, scale bar and axes.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "render/image/canvas.hpp"
#include "scene/world/data/scene.hpp"
#include "server/floors/floor_plan.hpp"
#include "server/plans/captions.hpp"
#include "server/plans/plan_image.hpp"

namespace enfilade::server {

/// A plan's place on a canvas. +x points right, +z down.
struct PlanView {
  scene::Aabb area;       ///< shown, scene frame, metres
  double floor = 0;       ///< height of the storey's floor, metres
  render::Point topLeft;  ///< of the area on the canvas
  double unitsPerMetre = 1;
  double unit = 1;  ///< canvas units of a thin line: 1 on images, less on pages

  CanvasBox box() const { return {topLeft, width(), height()}; }
  double width() const { return area.size().x() * unitsPerMetre; }
  double height() const { return area.size().z() * unitsPerMetre; }
  render::Point at(const Vec3& point) const {
    return {topLeft.x + (point.x() - area.min.x()) * unitsPerMetre,
            topLeft.y + (point.z() - area.min.z()) * unitsPerMetre};
  }
};

/// The view of what a plan camera shows.
PlanView makePlanView(const render::Camera& camera, double floor, render::Point topLeft,
                      double unitsPerMetre, double unit);

/// Draws the picture as the background of the view.
void drawPlanPicture(render::Canvas& canvas, const PlanView& view, const PlanPicture& picture);

/// Draws the shapes of a plan: walls filled dark, furniture light, doors with their swing.
void drawFloorPlan(render::Canvas& canvas, const PlanView& view, const FloorPlan& plan);

/// Draws grid lines and their coordinates outside of the view, and a frame around it.
void drawGrid(render::Canvas& canvas, const PlanView& view);

/// The lines above a plan, as many as its width needs.
struct PlanHeading {
  std::vector<std::string> title, note;
  render::TextStyle titleStyle, noteStyle;
  double height = 0;  ///< units, to the top of the plan
};
PlanHeading makePlanHeading(const std::string& title, const std::string& note, double width,
                            double unit);
void drawPlanHeading(render::Canvas& canvas, const PlanHeading& heading, double unit);

/// The words for a plan's floor and cut: "floor at y = 0.00 m, cut 1.1 m above".
std::string formatFloorAndCut(double floor);

/// Draws a scale bar with its top left corner at `at`, and right of it the axes. `north`: its
/// direction in x and z, if it is known.
void drawScaleBar(render::Canvas& canvas, const PlanView& view, render::Point at,
                  const std::optional<Eigen::Vector2d>& north);

/// Warns in the log if letters of a plan have no font here.
void reportMissingFont(const render::Canvas& canvas);

/// The lines of the list below a plan, in columns.
double measureEntries(const std::vector<CaptionEntry>& entries, double width, double unit);
void drawEntries(render::Canvas& canvas, const std::vector<CaptionEntry>& entries, render::Point at,
                 double width, double unit);

}  // namespace enfilade::server
