// Benchmark of a hull of 20 vertices against a mesh of 50,880 triangles: distance, and all
// triangles in contact.
//
//   collision_mesh [--quick] [--out FILE] [--only PART_OF_A_NAME]
//
// The mesh is a hilly terrain of 40 m x 40 m. The hull (radius 0.5 m) flies over it at 1.5 m/s and
// rotates by 1 degree a tick. It is about 0.3 m clear, or up to 0.2 m deep. Methods run in turns.
// The reference for sampled steps is our exact verdict on every triangle with a nearby box.

#include <algorithm>
#include <numbers>

#include "collision/narrow_phase/narrow_phase.hpp"
#include "collision/shapes/hull.hpp"
#include "tests/benchmarks/building_workload.hpp"
#include "tests/benchmarks/measurement.hpp"
#include "tests/benchmarks/mesh_method.hpp"

namespace {

using namespace enfilade::benchmarks;
namespace collision = enfilade::collision;

constexpr int kAlongX = 160, kAlongZ = 159;
constexpr double kStep = 0.25;  // metres
constexpr double kRadius = 0.5;
constexpr int kMaxTruths = 40;

double computeHeightAt(double x, double z) {
  return 0.6 * std::sin(0.5 * x) * std::cos(0.4 * z) + 0.15 * std::sin(2.1 * x + 1.3 * z) +
         0.05 * std::sin(7 * x) * std::sin(6 * z);
}

Vec3 computeGroundAt(int x, int z) {
  return {kStep * x, computeHeightAt(kStep * x, kStep * z), kStep * z};
}

Triangles makeTerrain() {
  Triangles triangles;
  for (int x = 0; x < kAlongX; ++x) {
    for (int z = 0; z < kAlongZ; ++z) {
      triangles.push_back(
          {computeGroundAt(x, z), computeGroundAt(x, z + 1), computeGroundAt(x + 1, z + 1)});
      triangles.push_back(
          {computeGroundAt(x, z), computeGroundAt(x + 1, z + 1), computeGroundAt(x + 1, z)});
    }
  }
  return triangles;
}

Points makeBodyPoints() {
  Random random(5);
  Points points;
  while (points.size() < 20) {
    const double x = drawUniform(random, -1, 1);
    const double y = drawUniform(random, -1, 1);
    const double z = drawUniform(random, -1, 1);
    const Vec3 v(x, y, z);
    if (v.squaredNorm() > 0.01 && v.squaredNorm() < 1) points.push_back(kRadius * v.normalized());
  }
  return points;
}

std::vector<RigidTransform> makeFlight(bool dipping, std::size_t steps) {
  const Vec3 axis = Vec3(0.3, 1, 0.2).normalized();
  const double side = 0.25 * kStep * kAlongX;  // circles about the centre
  std::vector<RigidTransform> places;
  for (std::size_t k = 0; k < steps; ++k) {
    const double along = 0.025 * static_cast<double>(k) / side;
    const double x = 2 * side + side * std::cos(along);
    const double z = 2 * side + side * std::sin(along);
    const double above =
        dipping ? kRadius - 0.1 + 0.1 * std::sin(0.05 * static_cast<double>(k)) : kRadius + 0.35;
    const double angle = std::numbers::pi / 180 * static_cast<double>(k);
    places.push_back({Eigen::AngleAxisd(angle, axis).toRotationMatrix(),
                      Vec3(x, computeHeightAt(x, z) + above, z)});
  }
  return places;
}

/// Minimum distance and contacts, by the exact verdict on every triangle in range.
struct Truth {
  double distance = std::numeric_limits<double>::infinity();
  std::vector<std::uint32_t> contacts;
};

Truth findTruth(const collision::Hull& hull, const RigidTransform& at, const Triangles& mesh) {
  const collision::PlacedConvex body{hull.vertices, at.translation, &at.rotation, &hull};
  const Vec3 reach = Vec3::Constant(3 * kRadius);
  const collision::Aabb near{at.translation - reach, at.translation + reach};
  Truth truth;
  for (std::uint32_t k = 0; k < mesh.size(); ++k) {
    if (!collision::overlaps(near, collision::computeAabb(mesh[k]))) continue;
    collision::FeatureCache cold;
    const auto reported = collision::computeSeparation(body, {mesh[k]}, cold);
    truth.distance = std::min(truth.distance, reported.distance);
    if (reported.verdict != collision::Verdict::separated) truth.contacts.push_back(k);
  }
  return truth;
}

struct Row {
  const MeshMethod* method = nullptr;
  std::unique_ptr<MeshQuery> query;
  double buildSeconds = 0;
  std::vector<double> distance, contacts, coldDistance, coldContacts;  ///< microseconds
  double worstError = 0;                                               ///< metres
  std::size_t missed = 0, wrong = 0;                                   ///< triangles
};

template <typename Ask>
double measureMicroseconds(const Ask& ask) {
  const auto start = Clock::now();
  ask();
  return 1e6 * measureSecondsSince(start);
}

/// Two passes, so that neither query warms the other's cache: a tick of the library makes only one
/// of them.
void fly(Row& row, std::span<const RigidTransform> places, std::span<const Truth> truths,
         std::size_t every) {
  row.query->forget();
  for (std::size_t k = 0; k < places.size(); ++k) {
    double reported = 0;
    const double time =
        measureMicroseconds([&] { reported = row.query->computeDistance(places[k]); });
    if (k > 0) row.distance.push_back(time);
    if (k % every == 0) {
      const double error = std::abs(reported - truths[k / every].distance);
      row.worstError = std::max(row.worstError, std::isfinite(error) ? error : 1e300);
    }
  }
  row.query->forget();
  for (std::size_t k = 0; k < places.size(); ++k) {
    std::vector<std::uint32_t> reported;
    const double time = measureMicroseconds([&] { row.query->findContacts(places[k], reported); });
    if (k > 0) row.contacts.push_back(time);
    if (k % every != 0) continue;
    std::sort(reported.begin(), reported.end());
    const auto& truth = truths[k / every].contacts;
    std::vector<std::uint32_t> rest;
    std::set_difference(truth.begin(), truth.end(), reported.begin(), reported.end(),
                        std::back_inserter(rest));
    row.missed += rest.size();
    rest.clear();
    std::set_difference(reported.begin(), reported.end(), truth.begin(), truth.end(),
                        std::back_inserter(rest));
    row.wrong += rest.size();
  }
}

void askCold(Row& row, std::span<const RigidTransform> places, std::size_t every) {
  for (std::size_t k = 0; k < places.size(); k += every) {
    row.query->forget();
    row.coldDistance.push_back(measureMicroseconds([&] { row.query->computeDistance(places[k]); }));
    row.query->forget();
    std::vector<std::uint32_t> reported;
    row.coldContacts.push_back(
        measureMicroseconds([&] { row.query->findContacts(places[k], reported); }));
  }
}

void print(const Row& row, const char* motion, Results& results) {
  const auto median = [](const std::vector<double>& v) { return computeQuantile(v, 0.5); };
  std::printf(
      "%-14s %-8s | distance %8.2f (cold %8.2f) us, error <= %8.1e m | contacts %8.2f "
      "(cold %8.2f) us, %zu missed %zu false | build %.3f s\n",
      row.method->name.c_str(), motion, median(row.distance), median(row.coldDistance),
      row.worstError, median(row.contacts), median(row.coldContacts), row.missed, row.wrong,
      row.buildSeconds);
  results.add({{"bench", "mesh"},
               {"method", row.method->name},
               {"ours", row.method->ours},
               {"motion", motion},
               {"distance_us", toJsonNumber(median(row.distance))},
               {"distance_cold_us", toJsonNumber(median(row.coldDistance))},
               {"distance_99_us", toJsonNumber(computeQuantile(row.distance, 0.99))},
               {"contacts_us", toJsonNumber(median(row.contacts))},
               {"contacts_cold_us", toJsonNumber(median(row.coldContacts))},
               {"contacts_99_us", toJsonNumber(computeQuantile(row.contacts, 0.99))},
               {"error_m", row.worstError},
               {"missed", row.missed},
               {"false", row.wrong},
               {"build_s", row.buildSeconds}});
}

}  // namespace

int main(int argc, char** argv) {
  const Arguments arguments(argc, argv);
  Results results(arguments);
  const std::size_t steps = arguments.quick ? 200 : 1000;
  const std::size_t every = steps / kMaxTruths;
  const int turns = arguments.quick ? 1 : 3;
  const Triangles mesh = makeTerrain();
  const Points points = makeBodyPoints();
  const collision::Hull hull = collision::buildHull(points);
  const auto methods = makeMeshMethods();
  for (const bool dipping : {false, true}) {
    const auto places = makeFlight(dipping, steps);
    std::vector<Truth> truths;
    for (std::size_t k = 0; k < steps; k += every)
      truths.push_back(findTruth(hull, places[k], mesh));
    std::vector<Row> rows;
    for (const MeshMethod& method : methods) {
      if (!arguments.wants(method.name)) continue;
      rows.emplace_back();
      rows.back().method = &method;
      const auto start = Clock::now();
      rows.back().query = method.make(points, mesh);
      rows.back().buildSeconds = measureSecondsSince(start);
    }
    for (int turn = 0; turn < turns; ++turn) {
      for (Row& row : rows) fly(row, places, truths, every);
    }
    for (Row& row : rows) askCold(row, places, every);
    for (const Row& row : rows) print(row, dipping ? "dipping" : "clear", results);
  }
}
