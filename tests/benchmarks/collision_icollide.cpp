// Benchmark after the five sweeps of Cohen et al. (1995): number, faces, density, rotation and
// translation of moving convex polytopes, with time and with missed and false contacts.
//
//   collision_icollide [--quick] [--out FILE] [--only PART_OF_A_NAME]
//
// Default parameters of the paper: 1000 polytopes of 36 faces; 10 degrees and 10 % of the radius a
// frame. Density 1 % (volume of the bodies relative to the cube that contains them). Bodies pass
// through one another and are reflected by the walls. A frame is timed from the new poses to all
// contacts: boxes, broad phase, narrow phase of every pair. The reference uses the same exact
// verdict another way: brute force over all boxes, each pair computed cold.

#include <unordered_map>

#include "collision/bounds/bounding_box.hpp"
#include "collision/narrow_phase/narrow_phase.hpp"
#include "tests/benchmarks/broad_phase_method.hpp"
#include "tests/benchmarks/building_workload.hpp"
#include "tests/benchmarks/measurement.hpp"
#include "tests/benchmarks/narrow_phase_method.hpp"

namespace {

using namespace enfilade::benchmarks;
namespace collision = enfilade::collision;
using collision::AabbMethod;
using collision::Hull;
using collision::PlacedConvex;
using collision::Pose;
using Contacts = std::vector<std::pair<std::uint32_t, std::uint32_t>>;  ///< a < b, ascending

struct Setting {
  std::size_t number = 1000, faces = 36;
  double density = 0.01, degrees = 10, radii = 0.1;  ///< per frame
};

// ---- the world ---------------------------------------------------------------------------------

double computeVolume(const Hull& hull) {
  double six = 0;
  for (const auto& face : hull.faces) {
    for (std::size_t k = 2; k < face.size(); ++k) {
      six += hull.vertices[face[0]].dot(hull.vertices[face[k - 1]].cross(hull.vertices[face[k]]));
    }
  }
  return six / 6;
}

/// Random vertices on the unit sphere: triangles, 2 V - 4 of them.
Hull makePolytope(Random& random, std::size_t faces) {
  Points points;
  for (std::size_t k = 0; k < faces / 2 + 2; ++k) points.push_back(drawDirection(random));
  return collision::buildHull(points);
}

struct Flyer {
  Pose pose;
  Mat3 rotation;  ///< of the pose
  Vec3 velocity;  ///< metres a frame
  collision::Quat turn;
};

class Swarm {
 public:
  explicit Swarm(const Setting& setting) : hull(makePolytope(random_, setting.faces)) {
    const double volume = computeVolume(hull) * static_cast<double>(setting.number);
    edge_ = std::cbrt(volume / setting.density);
    for (std::size_t k = 0; k < setting.number; ++k) flyers.push_back(makeFlyer(setting));
  }

  void step() {
    for (Flyer& f : flyers) {
      for (int axis = 0; axis < 3; ++axis) {
        const double at = f.pose.translation[axis];
        if (at < 0) f.velocity[axis] = std::abs(f.velocity[axis]);
        if (at > edge_) f.velocity[axis] = -std::abs(f.velocity[axis]);
      }
      f.pose.translation += f.velocity;
      f.pose.rotation = (f.turn * f.pose.rotation).normalized();
      f.rotation = f.pose.rotation.toRotationMatrix();
    }
  }
  PlacedConvex makeBody(std::size_t k) const {
    return {hull.vertices, flyers[k].pose.translation, &flyers[k].rotation, &hull};
  }

 private:
  Random random_{7};

 public:
  const Hull hull;
  std::vector<Flyer> flyers;

 private:
  Flyer makeFlyer(const Setting& setting) {
    Flyer f;
    const double x = drawUniform(random_, 0, edge_);
    const double y = drawUniform(random_, 0, edge_);
    const double z = drawUniform(random_, 0, edge_);
    f.pose.translation = Vec3(x, y, z);
    const Vec3 axis = drawDirection(random_);
    f.velocity = setting.radii * drawDirection(random_);
    f.turn = Eigen::AngleAxisd(setting.degrees * 0.017453292519943295, axis);
    f.rotation = Mat3::Identity();
    return f;
  }
  double edge_ = 0;
};

Contacts findTruth(const Swarm& swarm) {
  std::vector<Aabb> boxes;
  for (const Flyer& f : swarm.flyers)
    boxes.push_back(computeTightAabb(swarm.hull, f.rotation, f.pose.translation));
  Contacts contacts;
  for (std::uint32_t a = 0; a < boxes.size(); ++a) {
    for (std::uint32_t b = a + 1; b < boxes.size(); ++b) {
      if (!collision::overlaps(boxes[a], boxes[b])) continue;
      collision::FeatureCache cold;
      const auto reported =
          collision::computeSeparation(swarm.makeBody(a), swarm.makeBody(b), cold);
      if (reported.verdict != collision::Verdict::separated) contacts.emplace_back(a, b);
    }
  }
  return contacts;
}

// ---- ours and the peers ------------------------------------------------------------------------

/// Cost of a frame in milliseconds.
struct Frame {
  std::size_t pairs = 0;  ///< pairs given to the narrow phase
  double boxes = 0, broad = 0, narrow = 0;
  double sumParts() const { return boxes + broad + narrow; }
};

class Stopwatch {
 public:
  /// Milliseconds since the last lap.
  double takeLap() {
    const auto now = Clock::now();
    const double passed = std::chrono::duration<double, std::milli>(now - last_).count();
    last_ = now;
    return passed;
  }

 private:
  Clock::time_point last_ = Clock::now();
};

class Detector {
 public:
  virtual ~Detector() = default;
  /// Reports the contacts of this frame in any order.
  virtual Frame runFrame(const Swarm& swarm, Contacts& contacts) = 0;
};

enum class Boxes { fixedCubes, tight };

class BoxMaker {
 public:
  BoxMaker(Boxes kind, const Hull& hull)
      : hull_(hull),
        support_(kind == Boxes::fixedCubes
                     ? collision::buildSupportTable(hull, AabbMethod::sphereCube)
                     : collision::buildSupportTable(hull)) {}
  std::span<const Aabb> makeBoxes(const Swarm& swarm) {
    boxes_.resize(swarm.flyers.size());
    extremal_.resize(swarm.flyers.size());
    for (std::size_t k = 0; k < boxes_.size(); ++k) {
      const Flyer& f = swarm.flyers[k];
      boxes_[k] = collision::computeAabb(hull_, support_, f.rotation, f.pose.translation,
                                         extremal_[k], looked_);
    }
    return boxes_;
  }

 private:
  const Hull& hull_;
  collision::SupportTable support_;
  std::vector<Aabb> boxes_;
  std::vector<collision::ExtremalVertices> extremal_;
  std::uint64_t looked_ = 0;
};

/// Sort and sweep, and the narrow phase warm-started from the last frame's features.
class OurDetector : public Detector {
 public:
  OurDetector(Boxes kind, const Hull& hull) : boxes_(kind, hull), sweep_({}) {}

  Frame runFrame(const Swarm& swarm, Contacts& contacts) override {
    Frame frame;
    Stopwatch watch;
    const auto boxes = boxes_.makeBoxes(swarm);
    frame.boxes = watch.takeLap();
    for (std::uint32_t k = 0; k < boxes.size(); ++k) {
      if (inserted_) sweep_.move(k, boxes[k]);
      if (!inserted_) sweep_.insert(boxes[k]);
    }
    inserted_ = true;
    sweep_.update();
    for (const ProxyPair& pair : sweep_.removedPairs())
      features_.erase(makeKey(pair.proxy, pair.other));
    frame.broad = watch.takeLap();
    for (std::uint32_t a = 0; a < boxes.size(); ++a) {
      for (const auto& partner : sweep_.getOverlaps(a)) {
        if (partner.id <= a) continue;
        ++frame.pairs;
        const auto reported = collision::computeSeparation(
            swarm.makeBody(a), swarm.makeBody(partner.id), features_[makeKey(a, partner.id)]);
        if (reported.verdict != collision::Verdict::separated) contacts.emplace_back(a, partner.id);
      }
    }
    frame.narrow = watch.takeLap();
    return frame;
  }

 private:
  static std::uint64_t makeKey(std::uint32_t a, std::uint32_t b) {
    return (std::uint64_t{a} << 32) + b;
  }
  BoxMaker boxes_;
  collision::SortAndSweep sweep_;
  bool inserted_ = false;
  std::unordered_map<std::uint64_t, collision::FeatureCache> features_;
};

/// A peer's broad phase on fixed cubes, and its narrow phase.
class PeerDetector : public Detector {
 public:
  PeerDetector(const BroadPhaseMethod& broad, const NarrowPhaseMethod& narrow, const Swarm& swarm)
      : boxes_(Boxes::fixedCubes, swarm.hull),
        broad_(broad.make({})),
        pair_(narrow.make(swarm.hull.vertices, swarm.hull.vertices)) {}

  Frame runFrame(const Swarm& swarm, Contacts& contacts) override {
    Frame frame;
    Stopwatch watch;
    const auto boxes = boxes_.makeBoxes(swarm);
    frame.boxes = watch.takeLap();
    pairs_.clear();
    PairTally tally;
    tally.kept = &pairs_;
    broad_->runTick(boxes, tally);
    frame.broad = watch.takeLap();
    for (const ProxyPair& pair : pairs_) {
      pair_->forget();  // one pair object is used for all pairs
      const Answer reported =
          pair_->ask(getPlacement(swarm, pair.proxy), getPlacement(swarm, pair.other));
      if (reported.verdict == Answer::Verdict::collides)
        contacts.emplace_back(pair.proxy, pair.other);
    }
    frame.pairs = pairs_.size();
    frame.narrow = watch.takeLap();
    return frame;
  }

 private:
  static RigidTransform getPlacement(const Swarm& swarm, std::uint32_t k) {
    return {swarm.flyers[k].rotation, swarm.flyers[k].pose.translation};
  }
  BoxMaker boxes_;
  std::unique_ptr<BroadPhase> broad_;
  std::unique_ptr<PairOfBodies> pair_;
  std::vector<ProxyPair> pairs_;
};

struct Contestant {
  std::string name;
  std::unique_ptr<Detector> detector;
  std::vector<double> whole, boxes, broad, narrow;  ///< milliseconds
  std::size_t pairs = 0, missed = 0, wrong = 0;

  void add(const Frame& frame) {
    whole.push_back(frame.sumParts());
    boxes.push_back(frame.boxes);
    broad.push_back(frame.broad);
    narrow.push_back(frame.narrow);
  }
};

std::vector<Contestant> makeContestants(const Swarm& swarm, const Arguments& arguments) {
  std::vector<Contestant> all;
  const auto add = [&](const std::string& name, std::unique_ptr<Detector> detector) {
    if (!arguments.wants(name)) return;
    all.emplace_back();
    all.back().name = name;
    all.back().detector = std::move(detector);
  };
  add("ours, fixed cubes", std::make_unique<OurDetector>(Boxes::fixedCubes, swarm.hull));
  add("ours, tight boxes", std::make_unique<OurDetector>(Boxes::tight, swarm.hull));
  const std::pair<const char*, const char*> stacks[] = {{"FCL dynamic tree", "FCL libccd"},
                                                        {"Bullet Dbvt", "Bullet GjkEpa2"}};
  for (const BroadPhaseMethod& broad : makeBroadPhaseMethods()) {
    for (const NarrowPhaseMethod& narrow : makeNarrowPhaseMethods()) {
      for (const auto& [b, n] : stacks) {
        if (broad.name != b || narrow.name != n) continue;
        add(broad.name + " + " + narrow.name, std::make_unique<PeerDetector>(broad, narrow, swarm));
      }
    }
  }
  return all;
}

// ---- the sweeps --------------------------------------------------------------------------------

/// Counts the contacts of `a` that are not in `b`.
std::size_t countMissing(const Contacts& a, const Contacts& b) {
  Contacts rest;
  std::set_difference(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(rest));
  return rest.size();
}

void measure(const char* sweep, double value, const Setting& setting, std::size_t frames,
             const Arguments& arguments, Results& results) {
  Swarm swarm(setting);
  auto all = makeContestants(swarm, arguments);
  std::size_t trueContacts = 0;
  for (std::size_t frame = 0; frame < frames; ++frame) {
    swarm.step();
    const Contacts truth = findTruth(swarm);
    for (Contestant& one : all) {
      Contacts reported;
      const Frame cost = one.detector->runFrame(swarm, reported);
      if (frame > 0) one.add(cost);  // the first one inserts
      std::sort(reported.begin(), reported.end());
      one.pairs += cost.pairs;
      one.missed += countMissing(truth, reported);
      one.wrong += countMissing(reported, truth);
    }
    trueContacts += truth.size();
  }
  for (const Contestant& one : all) {
    const double median = computeQuantile(one.whole, 0.5);
    std::printf(
        "%-12s %8g | %-30s %8.3f ms a frame (%.3f boxes, %.3f broad, %.3f narrow) | "
        "%6.0f pairs %6.1f contacts a frame | missed %zu false %zu\n",
        sweep, value, one.name.c_str(), median, computeQuantile(one.boxes, 0.5),
        computeQuantile(one.broad, 0.5), computeQuantile(one.narrow, 0.5),
        static_cast<double>(one.pairs) / static_cast<double>(frames),
        static_cast<double>(trueContacts) / static_cast<double>(frames), one.missed, one.wrong);
    results.add({{"bench", "icollide"},
                 {"sweep", sweep},
                 {"value", value},
                 {"method", one.name},
                 {"ms", toJsonNumber(median)},
                 {"ms_99", toJsonNumber(computeQuantile(one.whole, 0.99))},
                 {"boxes_ms", toJsonNumber(computeQuantile(one.boxes, 0.5))},
                 {"broad_ms", toJsonNumber(computeQuantile(one.broad, 0.5))},
                 {"narrow_ms", toJsonNumber(computeQuantile(one.narrow, 0.5))},
                 {"pairs", static_cast<double>(one.pairs) / static_cast<double>(frames)},
                 {"contacts", trueContacts},
                 {"missed", one.missed},
                 {"false", one.wrong}});
  }
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  const Arguments arguments(argc, argv);
  Results results(arguments);
  const std::size_t frames = arguments.quick ? 20 : 150;
  const auto sweep = [&](const char* name, const std::vector<double>& values, const auto& apply) {
    for (std::size_t k = 0; k < values.size(); ++k) {
      if (arguments.quick && k % 2 != 0) continue;
      Setting setting;
      apply(setting, values[k]);
      measure(name, values[k], setting, frames, arguments, results);
    }
  };
  sweep("number", {100, 200, 500, 1000, 2000, 5000},
        [](Setting& s, double value) { s.number = static_cast<std::size_t>(value); });
  sweep("faces", {12, 20, 36, 100, 200, 400},
        [](Setting& s, double value) { s.faces = static_cast<std::size_t>(value); });
  sweep("density", {0.001, 0.005, 0.01, 0.02, 0.05, 0.1},
        [](Setting& s, double value) { s.density = value; });
  sweep("rotation", {0, 5, 10, 20, 30, 45}, [](Setting& s, double value) { s.degrees = value; });
  sweep("translation", {0, 0.05, 0.1, 0.2, 0.3, 0.5},
        [](Setting& s, double value) { s.radii = value; });
}
