// Reference implementation of the ray renderer: every pixel's ray against every triangle, in
// doubles, by another formula (Möller and Trumbore 1997). Opaque scenes only.
#pragma once

#include <cmath>
#include <limits>
#include <vector>

#include "render/camera/camera.hpp"
#include "scene/world/data/scene.hpp"

namespace enfilade::render {

struct BruteHit {
  scene::EntityId id = 0;
  double depth = std::numeric_limits<double>::infinity();
  double second = std::numeric_limits<double>::infinity();  ///< depth of the next other object
  /// Distance of the ray from the triangle's border: its minimum barycentric coordinate.
  double inside = 0;
};

inline BruteHit findBruteHit(
    const std::vector<std::pair<scene::EntityId, collision::Triangle>>& all, const Camera& camera,
    const Vec3& from, const Vec3& way) {
  BruteHit best;
  const Vec3 forward = computeCameraBasis(camera).forward;
  for (const auto& [id, t] : all) {
    const Vec3 e1 = t[1] - t[0], e2 = t[2] - t[0];
    const Vec3 p = way.cross(e2);
    const double det = e1.dot(p);
    if (det == 0) continue;
    const Vec3 s = from - t[0];
    const double u = s.dot(p) / det;
    const Vec3 q = s.cross(e1);
    const double v = way.dot(q) / det;
    if (u < 0 || v < 0 || u + v > 1) continue;
    const double z = e2.dot(q) / det * way.dot(forward);
    if (z < camera.near || z > camera.far) continue;
    if (z < best.depth) {
      if (best.id != id) best.second = best.depth;
      best = {id, z, best.second, std::min({u, v, 1 - u - v})};
    } else if (id != best.id) {
      best.second = std::min(best.second, z);
    }
  }
  return best;
}

/// Pixels are stored row by row.
inline std::vector<BruteHit> computeBruteFrame(const scene::Model& model, const Camera& camera) {
  std::vector<std::pair<scene::EntityId, collision::Triangle>> all;
  for (std::uint32_t o = 0; o < model.objects.size(); ++o)
    for (const collision::Triangle& t : scene::collectSolidTriangles(model, o))
      all.emplace_back(o + 1, t);
  const CameraBasis view = computeCameraBasis(camera);
  std::vector<BruteHit> hits;
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const double right = ((x + 0.5) / camera.width * 2 - 1 - view.shiftX) / view.scaleX;
      const double up = (1 - (y + 0.5) / camera.height * 2 - view.shiftY) / view.scaleY;
      const Vec3 aside = right * view.right + up * view.up;
      const bool perspective = camera.projection == Camera::Projection::perspective;
      hits.push_back(findBruteHit(all, camera, perspective ? camera.eye : Vec3(camera.eye + aside),
                                  perspective ? Vec3(view.forward + aside) : view.forward));
    }
  }
  return hits;
}

}  // namespace enfilade::render
