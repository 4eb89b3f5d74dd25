// Broad phases on one workload: a building of storeys and rooms, walkers and turning bodies.
//
//   broad_phase_bench [TICKS [MOST_OBJECTS]]
//   broad_phase_bench --ours OBJECTS MOVERS [TICKS]    ours alone, unchecked: for callgrind, with
//       valgrind --tool=callgrind --collect-atstart=no --toggle-collect='*Ours*tick*'
//
// 68 still objects a room of 6 m x 5 m, their order shuffled; 80 % of the movers are avatars at
// 1.5 m/s, the others turn and drift; 60 ticks a second. Printed for each size: median and 99th
// percentile of a tick (update, and reading every pair; without making the boxes), exchanges, box
// tests and cell entries a mover and tick, and beside them Boost.Geometry's R-tree asked afresh
// every tick.
//
// The motion is run kRuns times and a tick counts with the least of its times, since every run does
// the same work and a busy machine only adds to it; `p99 1st` is that of the first run alone, as a
// cold cache and a busy machine left it. A last run, untimed, compares the pairs of every tick with
// the R-tree's and those of sampled ticks with brute force; `wrong` counts the ticks that differ
// and must be 0.

#include <algorithm>
#include <boost/geometry.hpp>
#include <boost/geometry/index/rtree.hpp>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <random>
#include <vector>

#include "collision/sort_and_sweep.hpp"

namespace {

using namespace enfilade::collision;
namespace bgi = boost::geometry::index;
using Clock = std::chrono::steady_clock;
using Random = std::mt19937_64;

constexpr int kObjectsPerRoom = 68;
constexpr double kRoomX = 6, kRoomZ = 5, kStorey = 3;
constexpr double kSecondsPerTick = 1.0 / 60;
constexpr int kSampledTicks = 5;
constexpr int kRuns = 3;

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
  double build = 0, median = 0, p99 = 0, firstP99 = 0;
  std::size_t ends = 0;
  double exchanges = 0, boxTests = 0, entries = 0;  ///< a mover and tick
};

/// Ours: keeps its pairs; all of them are read every tick.
class Ours {
 public:
  explicit Ours(const Building& building) : sweep_(building.still) {}
  void start(const std::vector<Box>& boxes) {
    for (const Box& box : boxes) sweep_.insert(box);
    sweep_.update();
  }
  [[gnu::noinline]] std::size_t tick(const std::vector<Box>& boxes) {
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
  SweepCounters counters() const { return sweep_.counters(); }

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
  SweepCounters counters() const { return {}; }

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

/// The movers of one run: made and moved alike whoever watches.
class Motion {
 public:
  Motion(const Building& building, std::size_t movers) : extent_(building.extent), boxes_(movers) {
    Random random(2);
    bodies_ = makeBodies(random, movers, building);
    advance();
  }
  const std::vector<Box>& boxes() const { return boxes_; }
  void advance() {
    for (std::size_t k = 0; k < bodies_.size(); ++k) boxes_[k] = step(bodies_[k], extent_);
  }

 private:
  Vec3 extent_;
  std::vector<Body> bodies_;
  std::vector<Box> boxes_;
};

double percentile(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(static_cast<double>(values.size()) * share)];
}

template <typename Peer>
std::vector<double> timeRun(const Building& building, std::size_t movers, int ticks, Times& times) {
  const auto start = Clock::now();
  Peer peer(building);
  times.build = std::min(times.build, microsecondsSince(start) * 1e-6);
  times.exchanges = times.boxTests = times.entries = 0;
  Motion motion(building, movers);
  peer.start(motion.boxes());
  std::vector<double> durations;
  for (int tick = 0; tick < ticks; ++tick) {
    motion.advance();
    const auto begin = Clock::now();
    times.ends += peer.tick(motion.boxes());
    durations.push_back(microsecondsSince(begin));
    const double share = 1 / (static_cast<double>(movers) * ticks);
    times.exchanges += static_cast<double>(peer.counters().exchanges) * share;
    times.boxTests += static_cast<double>(peer.counters().boxTests) * share;
    times.entries += static_cast<double>(peer.counters().cellsLaid) * share;
  }
  return durations;
}

template <typename Peer>
Times measure(const Building& building, std::size_t movers, int ticks) {
  Times times;
  times.build = 1e9;
  std::vector<double> least = timeRun<Peer>(building, movers, ticks, times);
  times.firstP99 = percentile(least, 0.99);
  for (int run = 1; run < kRuns; ++run) {
    const std::vector<double> again = timeRun<Peer>(building, movers, ticks, times);
    for (std::size_t k = 0; k < least.size(); ++k) least[k] = std::min(least[k], again[k]);
  }
  times.median = percentile(least, 0.5);
  times.p99 = percentile(least, 0.99);
  return times;
}

/// Ticks whose pairs differ from the R-tree's, or on sampled ticks from brute force.
int wrongTicks(const Building& building, std::size_t movers, int ticks) {
  Ours ours(building);
  RTree tree(building);
  Motion motion(building, movers);
  ours.start(motion.boxes());
  int wrong = 0;
  for (int tick = 0; tick < ticks; ++tick) {
    motion.advance();
    ours.tick(motion.boxes());
    tree.tick(motion.boxes());
    auto told = ours.pairs(motion.boxes());
    bool right = told == tree.pairs(motion.boxes());
    if (tick % std::max(1, ticks / kSampledTicks) == 0) {
      std::vector<std::pair<MoverId, Box>> live;
      const std::size_t few = std::min<std::size_t>(movers, 50);  // brute force is slow
      for (MoverId id = 0; id < few; ++id) live.emplace_back(id, motion.boxes()[id]);
      std::erase_if(told, [few](const BoxPair& p) {
        return p.mover >= few || (p.otherMoves && p.other >= few);
      });
      right = right && told == bruteForcePairs(building.still, live);
    }
    wrong += right ? 0 : 1;
  }
  return wrong;
}

int report(const Building& building, std::size_t movers, int ticks, double bytes) {
  const Times ours = measure<Ours>(building, movers, ticks);
  const Times tree = measure<RTree>(building, movers, ticks);
  const int wrong = wrongTicks(building, movers, ticks);
  std::printf(
      "%8zu %6zu | %8.2f %8.2f %8.2f %5.2f %8.4f %5.2f %5.2f %5.3f %7.3f %5.1f %5d "
      "| %9.2f %9.2f %7.3f %5.1f\n",
      building.still.size(), movers, ours.median, ours.p99, ours.firstP99, ours.p99 / ours.median,
      ours.median / static_cast<double>(movers), ours.exchanges, ours.boxTests, ours.entries,
      ours.build, bytes, wrong, tree.median, tree.p99, tree.build, tree.median / ours.median);
  std::fflush(stdout);
  return wrong;
}

int oursAlone(std::size_t objects, std::size_t movers, int ticks) {
  const Building building = makeBuilding(objects);
  Times times;
  const std::vector<double> durations = timeRun<Ours>(building, movers, ticks, times);
  std::printf("%zu objects %zu movers %d ticks: median %.2f us p99 %.2f us, %zu ends of pairs\n",
              building.still.size(), movers, ticks, percentile(durations, 0.5),
              percentile(durations, 0.99), times.ends);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  const auto number = [&](int at, long otherwise) {
    return argc > at ? std::max(1L, std::atol(argv[at])) : otherwise;
  };
  if (argc > 1 && std::strcmp(argv[1], "--ours") == 0) {
    return oursAlone(static_cast<std::size_t>(number(2, 10000)),
                     static_cast<std::size_t>(number(3, 100)), static_cast<int>(number(4, 600)));
  }
  const int ticks = static_cast<int>(number(1, 600));
  const auto most = static_cast<std::size_t>(number(2, 1000000));
  std::printf("%8s %6s | %8s %8s %8s %5s %8s %5s %5s %5s %7s %5s %5s | %9s %9s %7s %5s\n",
              "objects", "movers", "median", "p99 us", "p99 1st", "ratio", "us/mover", "exch",
              "tests", "entry", "build s", "B/obj", "wrong", "rtree med", "rtree p99", "build s",
              "times");
  int wrong = 0;
  for (std::size_t objects = 1000; objects <= most; objects *= 10) {
    const Building building = makeBuilding(objects);
    const double bytes =
        static_cast<double>(SortAndSweep(building.still).bytesBesidesStillBoxes()) /
        static_cast<double>(building.still.size());
    for (const std::size_t movers : {10u, 100u, 1000u}) {
      wrong += report(building, movers, ticks, bytes);
    }
  }
  return wrong == 0 ? 0 : 3;
}
