// The exact first contact of translating bodies of one to three vertices, in rational arithmetic;
// and random pairs of such bodies.
#pragma once

#include <gmpxx.h>

#include <array>
#include <cstddef>
#include <optional>
#include <set>
#include <vector>

#include "collision/motion/moving_pose.hpp"
#include "tests/collision/random_shapes.hpp"

namespace enfilade::collision::testing {

inline Motion translate(const Vec3& velocity) {
  return {velocity, Vec3::Zero(), Vec3::Zero()};
}

using ExactVec3 = std::array<mpq_class, 3>;

inline ExactVec3 toExact(const Vec3& v) {
  return {mpq_class(v.x()), mpq_class(v.y()), mpq_class(v.z())};
}

inline ExactVec3 operator-(const ExactVec3& a, const ExactVec3& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

inline ExactVec3 computeExactCross(const ExactVec3& a, const ExactVec3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

inline mpq_class computeExactDot(const ExactVec3& a, const ExactVec3& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

inline ExactVec3 computeExactPosition(const Vec3& vertex, const Vec3& translation,
                                      const Vec3& velocity, const mpq_class& time) {
  ExactVec3 at = toExact(vertex);
  for (int k = 0; k < 3; ++k) at[k] += mpq_class(translation[k]) + mpq_class(velocity[k]) * time;
  return at;
}

/// A body of one to three vertices that translates uniformly.
struct ExactBody {
  const MovingBody& body;

  ExactVec3 computePosition(std::size_t i, const mpq_class& time) const {
    return computeExactPosition(body.body.vertices[i], body.body.translation, body.motion.velocity,
                                time);
  }
  std::size_t size() const { return body.body.vertices.size(); }
};

/// Time at which det(u, v, q) vanishes, for a q that moves uniformly.
inline std::optional<mpq_class> findZero(const mpq_class& atZero, const mpq_class& atOne) {
  if (atZero == atOne) return std::nullopt;
  return mpq_class(atZero / (atZero - atOne));
}

inline bool isInside(const ExactVec3& p, const std::array<ExactVec3, 3>& t,
                     const ExactVec3& normal) {
  for (int k = 0; k < 3; ++k)
    if (computeExactDot(computeExactCross(t[(k + 1) % 3] - t[k], p - t[k]), normal) < 0)
      return false;
  return true;
}

using Times = std::set<mpq_class>;

inline void addVertexTimes(const ExactBody& triangle, const ExactBody& points, Times& times) {
  if (triangle.size() < 3) return;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto cornersAt = [&](const mpq_class& time) {
      return std::array{triangle.computePosition(0, time), triangle.computePosition(1, time),
                        triangle.computePosition(2, time)};
    };
    const auto start = cornersAt(0), end = cornersAt(1);
    const ExactVec3 normal = computeExactCross(start[1] - start[0], start[2] - start[0]);
    const auto time = findZero(computeExactDot(points.computePosition(i, 0) - start[0], normal),
                               computeExactDot(points.computePosition(i, 1) - end[0], normal));
    if (time && *time >= 0 && isInside(points.computePosition(i, *time), cornersAt(*time), normal))
      times.insert(*time);
  }
}

inline void addEdgeTimes(const ExactBody& a, const ExactBody& b, Times& times) {
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t nextA = (i + 1) % a.size(), nextB = (j + 1) % b.size();
      const ExactVec3 u = a.computePosition(nextA, 0) - a.computePosition(i, 0),
                      v = b.computePosition(nextB, 0) - b.computePosition(j, 0);
      const ExactVec3 normal = computeExactCross(u, v);
      const auto time =
          findZero(computeExactDot(b.computePosition(j, 0) - a.computePosition(i, 0), normal),
                   computeExactDot(b.computePosition(j, 1) - a.computePosition(i, 1), normal));
      if (!time || *time < 0) continue;
      const ExactVec3 q = b.computePosition(j, *time) - a.computePosition(i, *time);
      // a + s u = b + r v: s and r in 0..1.
      const mpq_class size = computeExactDot(normal, normal);
      const mpq_class s = computeExactDot(computeExactCross(q, v), normal) / size,
                      r = computeExactDot(computeExactCross(q, u), normal) / size;
      if (s >= 0 && s <= 1 && r >= 0 && r <= 1) times.insert(*time);
    }
  }
}

/// The exact first time at which bodies that are separated at time 0 meet.
inline std::optional<mpq_class> findFirstTime(const MovingBody& a, const MovingBody& b) {
  Times times;
  addVertexTimes({a}, {b}, times);
  addVertexTimes({b}, {a}, times);
  if (a.body.vertices.size() > 1 && b.body.vertices.size() > 1) addEdgeTimes({a}, {b}, times);
  return times.empty() ? std::nullopt : std::optional(*times.begin());
}

/// Two bodies of one to three vertices that approach each other.
inline void makeThinPair(Random& random, int sizeA, int sizeB,
                         std::array<std::vector<Vec3>, 2>& points, MovingBody& a, MovingBody& b) {
  points = {makeRandomPoints(random, sizeA, 0.5), makeRandomPoints(random, sizeB, 0.5)};
  const Vec3 start = makeRandomPoint(random, 1).normalized() * drawUniform(random, 1.8, 4);
  a = {{points[0], start}, translate(makeRandomPoint(random, 0.4) - start)};
  b = {{points[1], makeRandomPoint(random, 0.1)}, translate(makeRandomPoint(random, 0.2))};
}

}  // namespace enfilade::collision::testing
