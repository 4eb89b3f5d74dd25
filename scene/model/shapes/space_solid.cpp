#include "scene/model/shapes/space_solid.hpp"

#include <algorithm>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "scene/model/shapes/collision_geometry.hpp"

namespace enfilade::scene {
namespace {

constexpr int kGridLines = 32;  ///< along each axis

using GroundPoint = Eigen::Vector2d;  // x and z

struct OutlineEdge {
  GroundPoint from, to;
};
using Outline = std::vector<OutlineEdge>;

struct Interval {
  double first, last;
};

GroundPoint toGround(const Vec3& point) {
  return {point.x(), point.z()};
}

/// The point at which an edge of a triangle meets a height between its ends.
GroundPoint cutEdge(const Vec3& low, const Vec3& high, double height) {
  const double t = (height - low.y()) / (high.y() - low.y());
  return toGround(low) + t * (toGround(high) - toGround(low));
}

/// The outline of the solid at a height. All edges turn the same way about it.
Outline cutSpace(const Space& space, double height) {
  Outline outline;
  for (std::size_t first = 0; first + 2 < space.surface.size(); first += 3) {
    std::optional<GroundPoint> from, to;
    for (std::size_t i = 0; i < 3; ++i) {
      const Vec3 &a = space.surface[first + i], &b = space.surface[first + (i + 1) % 3];
      const bool falls = a.y() >= height, rises = b.y() >= height;
      if (falls && !rises) from = cutEdge(b, a, height);
      if (rises && !falls) to = cutEdge(a, b, height);
    }
    if (from && to) outline.push_back({*from, *to});
  }
  return outline;
}

/// The parts of a line along `axis` (0: x, 1: z) that are inside, where the other axis is at `at`.
std::vector<Interval> findInside(const Outline& outline, int axis, double at) {
  const int other = 1 - axis;
  std::vector<std::pair<double, int>> crossings;
  for (const auto& [from, to] : outline) {
    const bool before = from[other] < at, after = to[other] < at;
    if (before == after) continue;
    const double t = (at - from[other]) / (to[other] - from[other]);
    crossings.emplace_back(from[axis] + t * (to[axis] - from[axis]), before ? 1 : -1);
  }
  std::ranges::sort(crossings);
  std::vector<Interval> inside;
  int winding = 0;
  for (const auto& [place, sign] : crossings) {
    if (winding == 0) inside.push_back({place, place});
    winding += sign;
    inside.back().last = place;
  }
  return inside;
}

double computeWallDistance(const Outline& outline, const GroundPoint& point) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const auto& [from, to] : outline) {
    const GroundPoint along = to - from;
    const double length = along.squaredNorm();
    const double t = length > 0 ? std::clamp(along.dot(point - from) / length, 0.0, 1.0) : 0;
    nearest = std::min(nearest, (from + t * along - point).norm());
  }
  return nearest;
}

/// Calls visit(point) for the points of a grid that are inside, and for the middle of each part of
/// its lines that is inside. A narrow corridor thus has points too.
template <class Visit>
void visitInside(const Outline& outline, const GroundPoint& low, const GroundPoint& high,
                 const Visit& visit) {
  const auto place = [&](int axis, int line) {
    return low[axis] + (line + 0.5) / kGridLines * (high[axis] - low[axis]);
  };
  for (int axis = 0; axis < 2; ++axis) {
    for (int line = 0; line < kGridLines; ++line) {
      GroundPoint point;
      point[1 - axis] = place(1 - axis, line);
      for (const Interval& part : findInside(outline, axis, point[1 - axis])) {
        const double first = std::max(part.first, low[axis]),
                     last = std::min(part.last, high[axis]);
        if (first >= last) continue;
        point[axis] = (first + last) / 2;
        visit(point);
        for (int i = 0; axis == 0 && i < kGridLines; ++i) {
          point[axis] = place(axis, i);
          if (point[axis] > first && point[axis] < last) visit(point);
        }
      }
    }
  }
}

/// The middle at a point; nullopt outside.
std::optional<SpaceMiddle> measureMiddle(const Outline& outline, const Vec3& point,
                                         const Aabb& area) {
  for (const Interval& part : findInside(outline, 0, point.z())) {
    const double first = std::max(part.first, area.min.x()),
                 last = std::min(part.last, area.max.x());
    const double side = std::min(point.x() - first, last - point.x());
    if (side > 0) return SpaceMiddle{point, 2 * side};
  }
  return std::nullopt;
}

}  // namespace

bool isInSpace(const Space& space, const Vec3& point) {
  if (space.surface.empty()) return collision::contains(space.box, {point, point});
  int winding = 0;
  for (std::size_t i = 0; i + 2 < space.surface.size(); i += 3)
    winding +=
        computeCrossing({space.surface[i], space.surface[i + 1], space.surface[i + 2]}, point);
  return winding != 0;  // some programs write surfaces inside out
}

SpaceMiddle findSpaceMiddle(const Space& space, const Aabb& area) {
  const Aabb seen{space.box.min.cwiseMax(area.min), space.box.max.cwiseMin(area.max)};
  const double height = space.box.centre().y();
  const Vec3 centre(seen.centre().x(), height, seen.centre().z());
  const SpaceMiddle ofBox{centre, seen.size().x()};
  if (space.surface.empty()) return ofBox;
  const Outline outline = cutSpace(space, height);
  if (const auto middle = measureMiddle(outline, centre, seen)) return *middle;
  const GroundPoint low = toGround(seen.min), high = toGround(seen.max);
  double farthest = 0;
  Vec3 best = centre;
  visitInside(outline, low, high, [&](const GroundPoint& point) {
    const double border = std::min((point - low).minCoeff(), (high - point).minCoeff());
    const double distance = std::min(border, computeWallDistance(outline, point));
    if (distance > farthest) farthest = distance, best = Vec3(point.x(), height, point.y());
  });
  return measureMiddle(outline, best, seen).value_or(ofBox);
}

}  // namespace enfilade::scene
