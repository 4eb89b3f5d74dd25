#include "server/plans/floor_plan_section.hpp"

#include <array>
#include <cstddef>

#include "collision/assert.hpp"
#include "server/plans/plan_image.hpp"

namespace enfilade::server {
namespace {

using collision::Vec3;

/// Cuts a triangle. A corner at the height counts as above, so that a shared edge is cut once.
void appendTriangleSection(const collision::Triangle& triangle, double height,
                           std::vector<SectionLine>& lines) {
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

void appendObjectSection(const scene::Model& model, std::uint32_t object, double height,
                         std::vector<SectionLine>& lines) {
  for (const collision::Triangle& triangle : scene::collectSolidTriangles(model, object))
    appendTriangleSection(triangle, height, lines);
}

}  // namespace

std::vector<SectionLine> cutStatic(const scene::Scene& scene, double height) {
  std::vector<SectionLine> lines;
  ENFILADE_ASSERT(scene.solidObjects().size() == scene.staticBoxes().size());
  for (std::size_t i = 0; i < scene.solidObjects().size(); ++i) {
    const scene::Aabb& box = scene.staticBoxes()[i];
    if (box.min.y() < height && box.max.y() >= height)
      appendObjectSection(scene.model(), scene.solidObjects()[i], height, lines);
  }
  return lines;
}

std::vector<SectionLine> cutScene(const scene::Scene& scene, double height) {
  std::vector<SectionLine> lines = cutStatic(scene, height);
  for (const scene::BodySpec& body : scene.model().bodies) {
    if (isTrigger(body.kind)) continue;
    for (const std::uint32_t object : body.objects)
      appendObjectSection(scene.model(), object, height, lines);
  }
  return lines;
}

void drawSection(render::Image& image, const render::Camera& camera,
                 const std::vector<SectionLine>& section, double left, double top) {
  for (const SectionLine& line : section) {
    const Vec3 from = render::project(camera, line.from), to = render::project(camera, line.to);
    render::drawLine(image, left + from.x(), top + from.y(), left + to.x(), top + to.y(), 2,
                     kPlanInk);
  }
}

}  // namespace enfilade::server
