#include "scene/navigation/walk/floor_faces.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace enfilade::scene {
namespace {

constexpr std::size_t kMaxDenseParts = 2000;  // of an object: above, its floor counts as uneven
constexpr double kLevel = 1e-6;               // metres: difference in height of a level face
constexpr double kGap = 2e-3;                 // metres between the feet and the floor
constexpr double kMinAdvance = 1e-6;          // metres

/// Twice the area of the projection to the ground, m^2; > 0: counter-clockwise seen from above.
double computeTwiceArea(const std::vector<Vec3>& corners) {
  double twice = 0;
  for (std::size_t i = 2; i < corners.size(); ++i) {
    const Vec3 a = corners[i - 1] - corners[0], b = corners[i] - corners[0];
    twice += a.z() * b.x() - a.x() * b.z();
  }
  return twice;
}

void addFace(std::vector<Vec3> corners, bool hasOutside, const Aabb& box,
             std::vector<FloorFace>& faces) {
  FloorFace face;
  for (const Vec3& corner : corners) face.box.include(corner);
  if (face.box.size().y() > kLevel || !overlaps(face.box, box)) return;
  const double twice = computeTwiceArea(corners);
  if (twice == 0 || (hasOutside && twice < 0)) return;
  if (twice < 0) std::reverse(corners.begin(), corners.end());
  face.y = face.box.max.y();
  face.corners = std::move(corners);
  faces.push_back(std::move(face));
}

void addConvex(const collision::PlacedConvex& convex, const Aabb& box,
               std::vector<FloorFace>& faces) {
  const auto place = [&](std::size_t i) {
    return collision::placeVertex(convex, convex.vertices[i]);
  };
  if (!convex.hull) {
    if (convex.vertices.size() == 3) addFace({place(0), place(1), place(2)}, false, box, faces);
    return;
  }
  for (const auto& face : convex.hull->faces) {
    std::vector<Vec3> corners;
    for (const std::uint32_t vertex : face) corners.push_back(place(vertex));
    addFace(std::move(corners), convex.hull->faces.size() > 2, box, faces);
  }
}

/// The interval of the line `from + t * direction` over a face; empty if the second is smaller.
std::pair<double, double> clip(const FloorFace& face, const Vec3& from, const Vec3& direction) {
  double enter = -1e300, leave = 1e300;
  for (std::size_t i = 0; i < face.corners.size(); ++i) {
    const Vec3& a = face.corners[i];
    const Vec3 edge = face.corners[(i + 1) % face.corners.size()] - a;
    // Inside is to the left of each edge, seen from above: positive.
    const auto side = [&](const Vec3& v) { return edge.z() * v.x() - edge.x() * v.z(); };
    const double distance = side(from - a), slope = side(direction);
    if (slope > 0) enter = std::max(enter, -distance / slope);
    if (slope < 0) leave = std::min(leave, -distance / slope);
    if (slope == 0 && distance < 0) return {0, -1};
  }
  return {enter, leave};
}

}  // namespace

std::vector<FloorFace> collectFloorFaces(const ObstacleSet& obstacles, const Aabb& box) {
  std::vector<FloorFace> faces;
  for (const Obstacle& obstacle : obstacles.list) addConvex(obstacle.convex, box, faces);
  std::vector<std::uint32_t> parts;
  for (const DenseObject& object : obstacles.dense) {
    parts.clear();
    object.geometry->query(box, parts);
    if (parts.size() > kMaxDenseParts) continue;
    for (const std::uint32_t part : parts) addConvex(object.geometry->convex(part), box, faces);
  }
  return faces;
}

double computeEvenDistance(const std::vector<FloorFace>& faces, const Vec3& footPosition,
                           const Vec3& direction, double length) {
  double reached = 0;
  for (bool advanced = true; advanced && reached < length;) {
    advanced = false;
    for (const FloorFace& face : faces) {
      const double gap = footPosition.y() - face.y;
      if (gap < 0 || gap > kGap) continue;
      const auto [enter, leave] = clip(face, footPosition, direction);
      if (enter > reached + kMinAdvance || leave < reached + kMinAdvance) continue;
      reached = leave;
      advanced = true;
    }
  }
  return std::min(reached, length);
}

}  // namespace enfilade::scene
