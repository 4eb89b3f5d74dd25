// Broad phases on one workload: a building of storeys and rooms, walkers and turning bodies.
//
//   broad_phase_bench [TICKS [MOST_OBJECTS]]
//
// 68 still objects a room of 6 m x 5 m, their order shuffled; 80 % of the movers are avatars at
// 1.5 m/s, the others turn and drift; 60 ticks a second. Printed for each size: median and 99th
// percentile of a tick (update and pairs, without making the boxes), exchanges and box tests a
// mover and tick, and beside them Boost.Geometry's R-tree asked afresh every tick. The pair sets of
// sampled ticks are compared with brute force; `wrong` counts the ticks that differ and must be 0.

#include <algorithm>
#include <boost/geometry.hpp>
#include <boost/geometry/index/rtree.hpp>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <vector>

#include "collision/sort_and_sweep.hpp"
#include "collision/still_cells.hpp"

namespace {

using namespace enfilade::collision;
namespace bgi = boost::geometry::index;
using Clock = std::chrono::steady_clock;
using Random = std::mt19937_64;

constexpr int kObjectsPerRoom = 68;
constexpr double kRoomX = 6, kRoomZ = 5, kStorey = 3;
constexpr double kSecondsPerTick = 1.0 / 60;
constexpr int kSampledTicks = 5;

double uniform(Random& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

double microsecondsSince(Clock::time_point start) {
  return std::chrono::duration<double, std::micro>(Clock::now() - start).count();
}

// ---- the workload ------------------------------------------------------------------------------

struct Building {
  std::vector<Box> still;
  Vec3 extent;
};

Box boxAt(double x, double y, double z, double sx, double sy, double sz) {
  return {Vec3(x, y, z), Vec3(x + sx, y + sy, z + sz)};
}

void furnishRoom(Random& random, const Vec3& at, std::vector<Box>& still) {
  still.push_back(boxAt(at.x(), at.y() - 0.2, at.z(), kRoomX, 0.2, kRoomZ));
  still.push_back(boxAt(at.x(), at.y(), at.z(), kRoomX, kStorey - 0.2, 0.15));
  still.push_back(boxAt(at.x(), at.y(), at.z(), 0.15, kStorey - 0.2, 2));
  still.push_back(boxAt(at.x(), at.y(), at.z() + 3, 0.15, kStorey - 0.2, 2));
  for (int k = 4; k < kObjectsPerRoom; ++k) {
    const bool large = k % 8 == 0;
    const double sx = uniform(random, 0.05, large ? 2.0 : 0.5);
    const double sy = uniform(random, 0.05, large ? 1.8 : 0.5);
    const double sz = uniform(random, 0.05, large ? 1.0 : 0.5);
    const double x = uniform(random, 0.2, kRoomX - sx);
    const double y = uniform(random, 0, k % 3 == 0 ? 2.0 : 0.9);
    const double z = uniform(random, 0.2, kRoomZ - sz);
    still.push_back(boxAt(at.x() + x, at.y() + y, at.z() + z, sx, sy, sz));
  }
}

Building makeBuilding(std::size_t objects) {
  Random random(1);
  const double rooms = std::ceil(static_cast<double>(objects) / kObjectsPerRoom);
  const int storeys = std::max(1, static_cast<int>(std::cbrt(rooms) / 2));
  const int along = std::max(1, static_cast<int>(std::ceil(std::sqrt(rooms / storeys))));
  Building building;
  for (int s = 0; s < storeys; ++s) {
    for (int x = 0; x < along; ++x) {
      for (int z = 0; z < along; ++z) {
        furnishRoom(random, Vec3(x * kRoomX, s * kStorey, z * kRoomZ), building.still);
      }
    }
  }
  std::shuffle(building.still.begin(), building.still.end(), random);
  building.extent = Vec3(along * kRoomX, storeys * kStorey, along * kRoomZ);
  return building;
}

struct Body {
  Vec3 centre, velocity, half, phase;
  bool turns;
};

std::vector<Body> makeBodies(Random& random, std::size_t count, const Building& building) {
  std::vector<Body> bodies;
  for (std::size_t k = 0; k < count; ++k) {
    const bool turns = k % 5 == 4;
    const double heading = uniform(random, 0, 6.28);
    const double speed = turns ? 0.3 : 1.5;
    const double storey = std::floor(uniform(random, 0, building.extent.y() / kStorey)) * kStorey;
    const double x = uniform(random, 0, building.extent.x());
    const double z = uniform(random, 0, building.extent.z());
    const double phase = uniform(random, 0, 6.28);
    bodies.push_back({Vec3(x, storey + 0.9, z),
                      Vec3(std::cos(heading), 0, std::sin(heading)) * speed * kSecondsPerTick,
                      Vec3(0.3, 0.875, 0.3), Vec3(phase, phase / 2, phase / 3), turns});
  }
  return bodies;
}

Box step(Body& body, const Vec3& extent) {
  for (const int axis : {0, 2}) {
    if (body.centre[axis] < 0) body.velocity[axis] = std::abs(body.velocity[axis]);
    if (body.centre[axis] > extent[axis]) body.velocity[axis] = -std::abs(body.velocity[axis]);
  }
  body.centre += body.velocity;
  if (!body.turns) return {body.centre - body.half, body.centre + body.half};
  body.phase += Vec3(0.02, 0.015, 0.025);
  const Vec3 half = (0.3 + 0.3 * body.phase.array().sin().abs()).matrix();
  return {body.centre - half, body.centre + half};
}

// ---- the peers ---------------------------------------------------------------------------------

struct Times {
  double build = 0, median = 0, p99 = 0;
  std::size_t pairs = 0;
  int wrong = 0;
  double exchanges = 0, boxTests = 0;  ///< a mover and tick
};

/// Ours: keeps its pairs; all of them are read every tick.
class Ours {
 public:
  explicit Ours(const Building& building) : sweep_(building.still) {}
  void start(const std::vector<Box>& boxes) {
    for (const Box& box : boxes) sweep_.insert(box);
    sweep_.update();
  }
  std::size_t tick(const std::vector<Box>& boxes) {
    for (MoverId id = 0; id < boxes.size(); ++id) sweep_.move(id, boxes[id]);
    sweep_.update();
    std::size_t ends = 0;
    for (MoverId id = 0; id < boxes.size(); ++id) ends += sweep_.partners(id).size();
    return ends;
  }
  std::vector<BoxPair> pairs(const std::vector<Box>& boxes) const {
    std::vector<BoxPair> result;
    for (MoverId id = 0; id < boxes.size(); ++id) {
      for (const auto& partner : sweep_.partners(id)) {
        if (!partner.moves || id < partner.id) result.push_back({id, partner.id, partner.moves});
      }
    }
    std::sort(result.begin(), result.end());
    return result;
  }
  double exchanges() const { return static_cast<double>(sweep_.counters().exchanges); }
  double boxTests() const { return static_cast<double>(sweep_.counters().boxTests); }

 private:
  SortAndSweep sweep_;
};

/// Boost.Geometry: packed tree of the still boxes, a second one of the movers every tick.
class RTree {
 public:
  explicit RTree(const Building& building) : still_(values(building.still)) {}
  void start(const std::vector<Box>& boxes) { tick(boxes); }
  std::size_t tick(const std::vector<Box>& boxes) {
    const Tree movers(values(boxes));
    found_.clear();
    for (MoverId id = 0; id < boxes.size(); ++id) {
      const BoostBox box = boostBox(boxes[id]);
      for (auto hit = still_.qbegin(bgi::intersects(box)); hit != still_.qend(); ++hit) {
        found_.push_back({id, hit->second, false});
      }
      for (auto hit = movers.qbegin(bgi::intersects(box)); hit != movers.qend(); ++hit) {
        if (id < hit->second) found_.push_back({id, hit->second, true});
      }
    }
    return found_.size();
  }
  std::vector<BoxPair> pairs(const std::vector<Box>&) const {
    std::vector<BoxPair> result = found_;
    std::sort(result.begin(), result.end());
    return result;
  }
  double exchanges() const { return 0; }
  double boxTests() const { return 0; }

 private:
  using Point = boost::geometry::model::point<double, 3, boost::geometry::cs::cartesian>;
  using BoostBox = boost::geometry::model::box<Point>;
  using Value = std::pair<BoostBox, std::uint32_t>;
  using Tree = bgi::rtree<Value, bgi::rstar<16>>;

  static BoostBox boostBox(const Box& b) {
    return {Point(b.min.x(), b.min.y(), b.min.z()), Point(b.max.x(), b.max.y(), b.max.z())};
  }
  static std::vector<Value> values(const std::vector<Box>& boxes) {
    std::vector<Value> result;
    for (std::uint32_t k = 0; k < boxes.size(); ++k) result.emplace_back(boostBox(boxes[k]), k);
    return result;
  }

  Tree still_;
  std::vector<BoxPair> found_;
};

template <typename Peer>
Times measure(const Building& building, std::size_t movers, int ticks) {
  Times times;
  const auto start = Clock::now();
  Peer peer(building);
  times.build = microsecondsSince(start) * 1e-6;

  Random random(2);
  std::vector<Body> bodies = makeBodies(random, movers, building);
  std::vector<Box> boxes(movers);
  const auto stepAll = [&] {
    for (std::size_t k = 0; k < movers; ++k) boxes[k] = step(bodies[k], building.extent);
  };
  stepAll();
  peer.start(boxes);
  std::vector<double> durations;
  for (int tick = 0; tick < ticks; ++tick) {
    stepAll();
    const auto begin = Clock::now();
    times.pairs = peer.tick(boxes);
    durations.push_back(microsecondsSince(begin));
    times.exchanges += peer.exchanges() / static_cast<double>(movers) / ticks;
    times.boxTests += peer.boxTests() / static_cast<double>(movers) / ticks;
    if (tick % std::max(1, ticks / kSampledTicks) != 0) continue;
    std::vector<std::pair<MoverId, Box>> live;
    for (MoverId id = 0; id < movers; ++id) live.emplace_back(id, boxes[id]);
    const std::size_t few = std::min<std::size_t>(movers, 50);  // brute force is slow
    const auto expected = bruteForcePairs(building.still, std::span(live).first(few));
    auto told = peer.pairs(boxes);
    std::erase_if(
        told, [&](const BoxPair& p) { return p.mover >= few || (p.otherMoves && p.other >= few); });
    times.wrong += told != expected;
  }
  std::sort(durations.begin(), durations.end());
  times.median = durations[durations.size() / 2];
  times.p99 = durations[durations.size() * 99 / 100];
  return times;
}

}  // namespace

int main(int argc, char** argv) {
  const int ticks = std::max(1, argc > 1 ? std::atoi(argv[1]) : 600);
  const std::size_t most = argc > 2 ? static_cast<std::size_t>(std::atoll(argv[2])) : 1000000;
  std::printf("%8s %6s | %9s %9s %9s %6s %6s %7s %7s %5s | %9s %9s %7s %5s\n", "objects", "movers",
              "median us", "p99 us", "us/mover", "exch", "tests", "build s", "B/obj", "wrong",
              "rtree med", "rtree p99", "build s", "wrong");
  int wrong = 0;
  for (std::size_t objects = 1000; objects <= most; objects *= 10) {
    const Building building = makeBuilding(objects);
    const StillCells cells(building.still);
    const double bytes =
        static_cast<double>(cells.bytesBesidesBoxes()) / static_cast<double>(building.still.size());
    for (const std::size_t movers : {10u, 100u, 1000u}) {
      const Times ours = measure<Ours>(building, movers, ticks);
      const Times tree = measure<RTree>(building, movers, ticks);
      std::printf(
          "%8zu %6zu | %9.2f %9.2f %9.4f %6.2f %6.2f %7.3f %7.1f %5d | %9.2f %9.2f %7.3f %5d\n",
          building.still.size(), movers, ours.median, ours.p99,
          ours.median / static_cast<double>(movers), ours.exchanges, ours.boxTests, ours.build,
          bytes, ours.wrong, tree.median, tree.p99, tree.build, tree.wrong);
      std::fflush(stdout);
      wrong += ours.wrong;
    }
  }
  return wrong == 0 ? 0 : 3;
}
