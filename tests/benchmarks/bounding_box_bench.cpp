// Bounding boxes of rotating bodies (Lin 1993, section 5.2.1): cost of each method, and pairs that
// its box admits.
//
//   bounding_box_bench [TICKS]
//   bounding_box_bench --only cube|climb|walls|all VERTICES [TICKS]
//      for callgrind, with valgrind --tool=callgrind --collect-atstart=no
//      --toggle-collect='*boxesOf*'
//
// Bodies of 8, 20 and 60 vertices in round to oblong ellipsoids rotate by 2 degrees a tick. Pairs:
// average overlaps of the cube and of the tight box with the boxes of a furnished storey (68 in a
// room of 6 m x 5 m x 3 m), and the choice of chooseAabbMethod().

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <random>
#include <string>
#include <vector>

#include "collision/bounds/bounding_box.hpp"

namespace {

using namespace enfilade::collision;
using Clock = std::chrono::steady_clock;
using Random = std::mt19937_64;

double uniform(Random& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

Hull ellipsoid(Random& random, std::size_t vertices, const Vec3& halfAxes) {
  std::vector<Vec3> points;
  std::normal_distribution<double> normal;
  for (std::size_t k = 0; k < vertices; ++k) {
    const double x = normal(random), y = normal(random), z = normal(random);
    points.push_back(Vec3(x, y, z).normalized().cwiseProduct(halfAxes));
  }
  return buildHull(points);
}

std::vector<Pose> turning(Random& random, int ticks) {
  std::vector<Pose> poses;
  Quat rotation = Quat::Identity();
  Vec3 axis(0.6, 0.64, 0.48);
  for (int k = 0; k < ticks; ++k) {
    const double x = uniform(random, -0.1, 0.1), y = uniform(random, -0.1, 0.1);
    axis = (axis + Vec3(x, y, 0.05)).normalized();
    const Vec3 half = axis * 0.01745;  // 2 degrees
    rotation = (Quat(1, half.x(), half.y(), half.z()) * rotation).normalized();
    poses.push_back({rotation, Vec3(3, 1, 2)});
  }
  return poses;
}

using Method = Aabb (*)(const Hull&, const Pose&, ExtremalVertices&);
struct Named {
  const char* name;
  Method method;
};
const std::vector<Named> kMethods{
    {"cube",
     [](const Hull& h, const Pose& p, ExtremalVertices&) { return boundingSphereCube(h, p); }},
    {"climb", [](const Hull& h, const Pose& p, ExtremalVertices& v) { return tightAabb(h, p, v); }},
    {"walls",
     [](const Hull& h, const Pose& p, ExtremalVertices& v) { return tightAabbVoronoi(h, p, v); }},
    {"all",
     [](const Hull& h, const Pose& p, ExtremalVertices&) { return tightAabbBruteForce(h, p); }}};

[[gnu::noinline]] double boxesOf(Method method, const Hull& hull, const std::vector<Pose>& poses) {
  ExtremalVertices last;
  double sum = 0;
  for (const Pose& pose : poses) sum += method(hull, pose, last).size().sum();
  return sum;
}

double nanoseconds(Method method, const Hull& hull, const std::vector<Pose>& poses) {
  double least = 1e300;
  for (int run = 0; run < 5; ++run) {
    const auto start = Clock::now();
    const double sum = boxesOf(method, hull, poses);
    const double time = std::chrono::duration<double, std::nano>(Clock::now() - start).count();
    if (sum > 0) least = std::min(least, time / static_cast<double>(poses.size()));
  }
  return least;
}

/// The static boxes of a room, relative to random body positions in it.
std::vector<Aabb> furniture(Random& random) {
  std::vector<Aabb> boxes;
  for (int k = 0; k < 68; ++k) {
    const bool large = k % 8 == 0;
    const double sx = uniform(random, 0.05, large ? 2.0 : 0.5);
    const double sy = uniform(random, 0.05, large ? 1.8 : 0.5);
    const double sz = uniform(random, 0.05, large ? 1.0 : 0.5);
    const double x = uniform(random, 0, 6), y = uniform(random, 0, 3), z = uniform(random, 0, 5);
    boxes.push_back({Vec3(x, y, z), Vec3(x + sx, y + sy, z + sz)});
  }
  return boxes;
}

/// Mean number of overlaps for a body at random positions in a room that repeats on all sides.
double meanMet(Method method, const Hull& hull, const std::vector<Pose>& poses,
               const std::vector<Aabb>& room) {
  Random random(3);
  ExtremalVertices last;
  double met = 0;
  for (Pose pose : poses) {
    const double x = uniform(random, 0, 6), y = uniform(random, 0, 3), z = uniform(random, 0, 5);
    pose.translation = Vec3(x, y, z);
    const Aabb box = method(hull, pose, last);
    for (const Aabb& other : room) {
      double count = 1;
      for (int axis = 0; axis < 3; ++axis) {
        const double period = axis == 0 ? 6 : axis == 1 ? 3 : 5;
        const double first = std::ceil((box.min[axis] - other.max[axis]) / period);
        count *= std::floor((box.max[axis] - other.min[axis]) / period) - first + 1;
      }
      met += count;
    }
  }
  return met / static_cast<double>(poses.size());
}

int only(const std::string& name, std::size_t vertices, int ticks) {
  Random random(1);
  const Hull hull = ellipsoid(random, vertices, Vec3(0.5, 0.4, 0.3));
  const std::vector<Pose> poses = turning(random, ticks);
  for (const Named& named : kMethods) {
    if (name == named.name) std::printf("%.3f\n", boxesOf(named.method, hull, poses));
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc > 3 && std::strcmp(argv[1], "--only") == 0) {
    return only(argv[2], static_cast<std::size_t>(std::atol(argv[3])),
                argc > 4 ? std::atoi(argv[4]) : 1000);
  }
  const int ticks = argc > 1 ? std::max(1, std::atoi(argv[1])) : 2000;
  Random random(1);
  const std::vector<Pose> poses = turning(random, ticks);
  const std::vector<Aabb> room = furniture(random);
  std::printf("%22s %8s | %6s %6s %6s %6s ns | %8s %8s | %s\n", "half axes, m", "vertices", "cube",
              "climb", "walls", "all", "met cube", "tight", "chosen");
  for (const double size : {0.1, 0.25, 0.5}) {
    for (const double oblong : {1.0, 2.0, 4.0}) {
      for (const std::size_t vertices : {8u, 20u, 60u}) {
        const Vec3 half = size * Vec3(oblong, 1, 1);
        const Hull hull = ellipsoid(random, vertices, half);
        std::printf("%6.2f x %5.2f x %5.2f %8zu |", half.x(), half.y(), half.z(), vertices);
        for (const Named& named : kMethods) {
          std::printf(" %6.1f", nanoseconds(named.method, hull, poses));
        }
        std::printf("    | %8.2f %8.2f | %s\n", meanMet(kMethods[0].method, hull, poses, room),
                    meanMet(kMethods[1].method, hull, poses, room),
                    chooseAabbMethod(hull) == AabbMethod::boundingSphereCube ? "cube" : "tight");
      }
    }
  }
}
