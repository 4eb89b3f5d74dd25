// Boxes of turning bodies (Lin 1993, section 5.2.1). Of each method: cost, vertices that it looks
// at, size of its box, and boxes that do not contain the body, by rationals.
//
//   collision_boxes [--quick] [--out FILE] [--only PART_OF_A_METHOD]
//
// 1,000 bodies (250 of 2,000 vertices, 50 of 10,000) have the same hull. It is an ellipsoid of 8 to
// 10,000 vertices and half axes of 0.2, 0.15 and 0.1 m. Each turns about its own axis by 2 or 10
// degrees a tick. Where a climb may cost as much as a scan, also by 4 or 6. In every tick each
// method computes all boxes, in random order. No method always finds the vertices that the same
// other one left in the cache.
#include <gmpxx.h>

#include <algorithm>
#include <numbers>
#include <numeric>

#include "tests/benchmarks/box_methods.hpp"
#include "tests/benchmarks/measurement.hpp"
#include "tests/benchmarks/random.hpp"

namespace enfilade::benchmarks {
namespace {

/// Fewer of the largest hulls: a method's turn stays shorter than a time slice of the system.
std::size_t chooseBodyCount(std::size_t vertices) {
  return std::min<std::size_t>(1000, 500'000 / vertices);
}

constexpr double kRadiansPerDegree = std::numbers::pi / 180;

Hull makeEllipsoid(Random& random, std::size_t vertices) {
  std::vector<Vec3> points;
  for (std::size_t k = 0; k < vertices; ++k)
    points.push_back(drawDirection(random).cwiseProduct(Vec3(0.2, 0.15, 0.1)));
  return collision::buildHull(points);
}

/// Bodies that turn about their own axes, each by the same angle a tick.
class Turning {
 public:
  Turning(Random& random, std::size_t bodies, double degrees) {
    for (std::size_t k = 0; k < bodies; ++k) {
      const Vec3 axis = drawDirection(random);
      const double x = drawUniform(random, -50, 50), y = drawUniform(random, 0, 3),
                   z = drawUniform(random, -50, 50);
      poses_.push_back({Quat::Identity(), Mat3::Identity(), Vec3(x, y, z)});
      steps_.emplace_back(Eigen::AngleAxisd(degrees * kRadiansPerDegree, axis));
    }
  }
  const std::vector<TurnedPose>& next() {
    for (std::size_t k = 0; k < poses_.size(); ++k) {
      poses_[k].orientation = (steps_[k] * poses_[k].orientation).normalized();
      poses_[k].rotation = poses_[k].orientation.toRotationMatrix();
    }
    return poses_;
  }

 private:
  std::vector<TurnedPose> poses_;
  std::vector<Quat> steps_;
};

using Rationals = std::array<mpq_class, 3>;
using RationalMatrix = std::array<Rationals, 3>;

RationalMatrix makeMatrix(const Mat3& rotation) {
  RationalMatrix rows;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      rows[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)] = rotation(i, j);
  return rows;
}

/// The rotation of the quaternion after exact normalisation.
RationalMatrix makeMatrix(const Quat& q) {
  const mpq_class w(q.w()), x(q.x()), y(q.y()), z(q.z());
  const mpq_class n = w * w + x * x + y * y + z * z;
  RationalMatrix rows{Rationals{n - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
                      Rationals{2 * (x * y + w * z), n - 2 * (x * x + z * z), 2 * (y * z - w * x)},
                      Rationals{2 * (x * z - w * y), 2 * (y * z + w * x), n - 2 * (x * x + y * y)}};
  for (Rationals& row : rows)
    for (mpq_class& entry : row) entry /= n;
  return rows;
}

bool containsExactly(const Aabb& box, const Hull& hull, const RationalMatrix& rotation,
                     const Vec3& translation) {
  for (const Vec3& v : hull.vertices) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto k = static_cast<int>(axis);
      const Rationals& row = rotation[axis];
      const mpq_class at = row[0] * v.x() + row[1] * v.y() + row[2] * v.z() + translation[k];
      if (at < box.min[k] || at > box.max[k]) return false;
    }
  }
  return true;
}

struct Contestant {
  std::string name;
  std::unique_ptr<BoxUpdate> update;
  std::vector<Aabb> boxes;
  std::vector<double> nanoseconds;  ///< a box, per tick
  std::size_t checked = 0, notConservative = 0;
  double volume = 0;
};

void checkBoxes(Contestant& one, const Hull& hull, const std::vector<TurnedPose>& poses,
                std::size_t stride) {
  for (std::size_t k = 0; k < poses.size(); k += stride) {
    const TurnedPose& pose = poses[k];
    const bool contains =
        containsExactly(one.boxes[k], hull, makeMatrix(pose.rotation), pose.translation) &&
        containsExactly(one.boxes[k], hull, makeMatrix(pose.orientation), pose.translation);
    ++one.checked;
    one.notConservative += contains ? 0 : 1;
  }
}

bool isOurs(const std::string& name) {
  using collision::AabbMethod;
  return name == getName(AabbMethod::sphereCube) || name == getName(AabbMethod::vertexScan) ||
         name == getName(AabbMethod::hillClimb) || name == kClimbAlways;
}

/// Returns the number of our boxes that do not contain their body.
std::size_t measure(std::size_t vertices, double degrees, const Arguments& arguments,
                    Results& results) {
  Random random(vertices);
  const Hull hull = makeEllipsoid(random, vertices);
  const std::size_t bodies = chooseBodyCount(vertices);
  Turning turning(random, bodies, degrees);
  std::vector<Contestant> all;
  for (const BoxMethod& method : makeBoxMethods()) {
    if (!arguments.wants(method.name)) continue;
    all.push_back({method.name, method.make(hull, bodies), std::vector<Aabb>(bodies), {}});
  }
  std::vector<std::size_t> order(all.size());
  std::iota(order.begin(), order.end(), 0);
  const std::size_t ticks = arguments.quick ? 20 : 200;
  for (std::size_t tick = 0; tick < ticks; ++tick) {
    const std::vector<TurnedPose>& poses = turning.next();
    std::ranges::shuffle(order, random);
    for (const std::size_t turn : order) {
      Contestant& one = all[turn];
      const auto start = Clock::now();
      one.update->update(poses, one.boxes);
      one.nanoseconds.push_back(1e9 * measureSecondsSince(start) / static_cast<double>(bodies));
      for (const Aabb& box : one.boxes) one.volume += box.size().prod();
      if (tick % 20 == 19) checkBoxes(one, hull, poses, 1 + vertices / 8);
    }
  }
  const std::string chosen = getName(collision::chooseAabbMethod(hull));
  std::size_t wrong = 0;
  for (const Contestant& one : all) {
    const double boxes = static_cast<double>(ticks * bodies);
    const double looked = static_cast<double>(one.update->getExaminedVertices()) / boxes;
    const double time = computeQuantile(one.nanoseconds, 0.5);
    if (isOurs(one.name)) wrong += one.notConservative;
    std::printf(
        "%4zu vertices %3g degrees | %-12s %8.1f ns %8.1f vertices a box | mean volume "
        "%8.5f m3 | %zu of %zu not conservative%s\n",
        hull.vertices.size(), degrees, one.name.c_str(), time, looked, one.volume / boxes,
        one.notConservative, one.checked, one.name == chosen ? " | chosen" : "");
    results.add({{"vertices", hull.vertices.size()},
                 {"degrees", degrees},
                 {"method", one.name},
                 {"ns", toJsonNumber(time)},
                 {"looked", looked},
                 {"volume", one.volume / boxes},
                 {"checked", one.checked},
                 {"not_conservative", one.notConservative},
                 {"chosen", one.name == chosen}});
  }
  return wrong;
}

}  // namespace
}  // namespace enfilade::benchmarks

int main(int argc, char** argv) {
  using namespace enfilade::benchmarks;
  const Arguments arguments(argc, argv);
  Results results(arguments);
  std::size_t wrong = 0;
  for (const std::size_t vertices : {8u, 22u, 30u, 40u, 50u, 64u, 106u, 500u, 2000u, 10'000u})
    for (const double degrees : {2.0, 4.0, 6.0, 10.0}) {
      const bool isNearBreakEven = vertices >= 50 && vertices <= 106;
      if (isNearBreakEven || degrees == 2 || degrees == 10)
        wrong += measure(vertices, degrees, arguments, results);
    }
  return wrong == 0 ? 0 : 3;
}
