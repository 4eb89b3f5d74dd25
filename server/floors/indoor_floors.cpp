// A point of a floor is indoors if the next surface above it is as high as a ceiling. A point with
// a low surface above, such as a lawn below a house, is not; nor is one below the sky. A ray that
// starts in a wall ends at its top: the floor below walls counts too, also of a house without roof.
#include "server/floors/indoor_floors.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "scene/world/queries/ray_caster.hpp"
#include "server/floors/storey_heights.hpp"

namespace enfilade::server {
namespace {

constexpr double kMinHeadroom = 1.8;        // metres: a person can stand
constexpr double kMaxDistance = 2.0;        // metres to another height, less than between storeys
constexpr double kFloorTolerance = 0.1;     // metres
constexpr double kIndoorShare = 0.5;        // of a floor that is mostly indoors
constexpr double kSampleArea = 1.0;         // square metres for each ray
constexpr double kMaxFaceSamples = 256;     // rays of one triangle
constexpr std::size_t kMaxFaces = 200'000;  // triangles with rays: a second
constexpr double kRayLift = 0.01;           // metres that a ray starts above its triangle

/// Point i of a sequence that covers a triangle evenly (Roberts, the R2 sequence, folded).
Vec3 samplePoint(const FloorTriangle& face, int i) {
  constexpr double kFirst = 0.7548776662466927, kSecond = 0.5698402909980532;
  double u = std::fmod(0.5 + i * kFirst, 1.0), v = std::fmod(0.5 + i * kSecond, 1.0);
  if (u + v > 1) u = 1 - u, v = 1 - v;
  const auto& [a, b, c] = face.corners;
  return a + u * (b - a) + v * (c - a);
}

/// Area of a triangle that lies indoors, square metres.
double measureIndoors(const scene::RayCaster& rays, const FloorTriangle& face) {
  const int count =
      static_cast<int>(std::clamp(std::ceil(face.area / kSampleArea), 1.0, kMaxFaceSamples));
  int indoors = 0;
  for (int i = 0; i < count; ++i) {
    const auto hit = rays.firstHit({samplePoint(face, i) + Vec3(0, kRayLift, 0), Vec3::UnitY()});
    if (hit && hit->distance >= kMinHeadroom) ++indoors;
  }
  return face.area * indoors / count;
}

}  // namespace

double findIndoorFloor(const scene::Scene& scene, std::span<const FloorTriangle> faces,
                       double height) {
  std::vector<const FloorTriangle*> near;
  for (const FloorTriangle& face : faces)
    if (face.area > 0 && std::abs(face.height() - height) < kMaxDistance) near.push_back(&face);
  const std::size_t stride = near.size() / kMaxFaces + 1;
  // The caster lives only in this function.
  const scene::RayCaster rays(std::shared_ptr<const scene::Scene>(std::shared_ptr<void>(), &scene));
  std::vector<WeightedHeight> indoors;
  double area = 0, indoorArea = 0;
  for (std::size_t i = 0; i < near.size(); i += stride) {
    const double inside = measureIndoors(rays, *near[i]);
    const bool isHere = std::abs(near[i]->height() - height) <= kFloorTolerance;
    if (isHere) area += near[i]->area, indoorArea += inside;
    if (inside > 0) indoors.push_back({near[i]->height(), inside});
  }
  if (indoors.empty() || indoorArea >= kIndoorShare * area) return height;
  return findStoreyHeights(indoors, 0, 1).front();
}

}  // namespace enfilade::server
