#include "server/plans/floor_plan_section.hpp"

#include <array>
#include <cstddef>

#include "server/plans/plan_image.hpp"

namespace enfilade::server {
namespace {

using collision::Vec3;

/// A corner at the height counts as above it, so that neighbours cut their common edge once.
void addCut(const collision::Triangle& triangle, double height, std::vector<CutLine>& lines) {
  std::array<Vec3, 2> ends;
  std::size_t count = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3 &a = triangle[k], &b = triangle[(k + 1) % 3];
    if ((a.y() < height) == (b.y() < height)) continue;
    ends[count] = a + (height - a.y()) / (b.y() - a.y()) * (b - a);
    ends[count++].y() = height;
  }
  if (count == 2) lines.push_back({ends[0], ends[1]});
}

void addCuts(const scene::Model& model, std::uint32_t object, double height,
             std::vector<CutLine>& lines) {
  for (const collision::Triangle& triangle : scene::solidTriangles(model, object))
    addCut(triangle, height, lines);
}

}  // namespace

std::vector<CutLine> cutOfStill(const scene::Scene& scene, double height) {
  std::vector<CutLine> lines;
  for (std::size_t i = 0; i < scene.solidObjects().size(); ++i) {
    const scene::Box& box = scene.stillBoxes()[i];
    if (box.min.y() < height && box.max.y() >= height)
      addCuts(scene.model(), scene.solidObjects()[i], height, lines);
  }
  return lines;
}

std::vector<CutLine> cutAt(const scene::Scene& scene, double height) {
  std::vector<CutLine> lines = cutOfStill(scene, height);
  for (const scene::BodySpec& body : scene.model().bodies) {
    if (body.kind == scene::BodyKind::trigger) continue;
    for (const std::uint32_t object : body.objects) addCuts(scene.model(), object, height, lines);
  }
  return lines;
}

void drawCut(render::Image& image, const render::Camera& camera, const std::vector<CutLine>& cut,
             double left, double top) {
  for (const CutLine& line : cut) {
    const Vec3 from = render::project(camera, line.from), to = render::project(camera, line.to);
    render::drawLine(image, left + from.x(), top + from.y(), left + to.x(), top + to.y(), 2,
                     kPlanInk);
  }
}

}  // namespace enfilade::server
