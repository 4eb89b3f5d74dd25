// Still boxes that come and go while movers walk, turn and jump; and the audit that finds faults.

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <random>
#include <stdexcept>
#include <vector>

#include "collision/broad_phase/broad_phase_audit.hpp"
#include "collision/broad_phase/sort_and_sweep.hpp"
#include "tests/collision/checked_sweep.hpp"

namespace enfilade::collision {
namespace {

/// Walkers, turning bodies, jumps; movers and still boxes that come and go: a tick of everything.
class Turmoil {
 public:
  Turmoil(std::uint64_t seed, std::size_t still, const Vec3& extent)
      : random_(seed), extent_(extent), scene(furnishedHall(random_, still, extent)) {
    for (StillId id = 0; id < still; ++id) stills_.push_back(id);
  }

  void tick(int mostStillEdits) {
    while (scene.movers().size() < 30) addMover();
    for (const auto& [id, box] : std::map(scene.movers())) moveOne(id, box);
    const int edits = dice(random_, 0, mostStillEdits);
    for (int k = 0; k < edits; ++k) editStill();
  }

  std::size_t jumps = 0, stillCame = 0, stillWent = 0, passing = 0;

 private:
  Box anyStill() {
    const double grow = dice(random_, 0, 30) == 0 ? 10 : 1;
    const Vec3 corner = uniform3(random_, Vec3(-6, -3, -6), extent_ + Vec3(6, 3, 6));
    return boxAt(corner, grow * uniform3(random_, Vec3::Zero(), Vec3(1.5, 1, 1.5)));
  }
  void addMover() {
    scene.insert(boxAt(uniform3(random_, Vec3::Zero(), extent_), Vec3(0.6, 1.75, 0.6)));
  }
  void moveOne(MoverId id, const Box& box) {
    const bool outside = !overlaps(box, boxAt(Vec3::Zero(), extent_));
    const int what = outside ? 1 : dice(random_, 0, 60);
    if (what == 0) {
      scene.remove(id);
    } else if (what == 1) {
      ++jumps;
      scene.move(id, boxAt(uniform3(random_, Vec3::Zero(), extent_), box.size()));
    } else if (what < 30) {  // walks on, its heading kept by its id
      const double x = 0.03 * (id % 5) - 0.06, z = 0.03 * (id % 7) - 0.09;
      scene.move(id, {box.min + Vec3(x, 0, z), box.max + Vec3(x, 0, z)});
    } else if (what < 50) {  // turns: grows here and shrinks there
      const Vec3 by = uniform3(random_, Vec3::Constant(-0.03), Vec3::Constant(0.03));
      const Box turned{box.min + by, box.max - by};
      if (!turned.empty()) scene.move(id, turned);
    }
  }
  void editStill() {
    if (dice(random_, 0, 99) < (stills_.size() < 600 ? 60 : 50) || stills_.empty()) {
      ++stillCame;
      stills_.push_back(scene.insertStill(anyStill()));
      if (dice(random_, 0, 5) > 0) return;
      ++passing;  // comes and goes within one tick
    }
    const auto at =
        static_cast<std::size_t>(dice(random_, 0, static_cast<int>(stills_.size()) - 1));
    scene.removeStill(stills_[at]);
    stills_[at] = stills_.back();
    stills_.pop_back();
    ++stillWent;
  }

  Random random_;
  Vec3 extent_;
  std::vector<StillId> stills_;

 public:
  Watched scene;
};

TEST(SortAndSweepEdits, EqualsBruteForceWhileEverythingComesGoesTurnsAndJumps) {
  std::size_t rebuilds = 0, editedTicks = 0, begins = 0;
  for (const std::uint64_t seed : {21, 22, 23, 24}) {
    Turmoil turmoil(seed, 300 * (seed - 21), Vec3(14, 6, 14));  // the first starts empty
    for (int tick = 0; tick < 600; ++tick) {
      turmoil.tick(tick % 50 == 49 ? 200 : 4);
      ASSERT_NO_FATAL_FAILURE(turmoil.scene.updateAndCheck()) << "tick " << tick;
      rebuilds += turmoil.scene.sweep().counters().rebuilds;
      editedTicks += turmoil.scene.sweep().counters().stillEdits > 0 ? 1 : 0;
    }
    begins += turmoil.scene.begins;
    EXPECT_GT(turmoil.scene.begins, 200u);
    EXPECT_GT(turmoil.scene.ends, 200u);
    EXPECT_GT(turmoil.scene.movingBegins, 50u);
    EXPECT_GT(turmoil.jumps, 50u);
    EXPECT_GT(turmoil.stillCame, 300u);
    EXPECT_GT(turmoil.stillWent, 300u);
    EXPECT_GT(turmoil.passing, 10u);
  }
  EXPECT_GT(begins, 4000u);
  EXPECT_GT(rebuilds, 5u);
  EXPECT_GT(editedTicks, 5 * rebuilds) << "edits in place were hardly tried";
}

TEST(SortAndSweepEdits, ASceneThatGrowsFromNothingFarBeyondItsFirstBoundsStaysExact) {
  Random random(25);
  Watched scene({});
  const MoverId id = scene.insert(boxAt(Vec3::Zero(), Vec3::Ones()));
  double reach = 1;
  for (int tick = 0; tick < 120; ++tick, reach *= 1.5) {  // to 1e21 m
    for (int k = 0; k < 9; ++k) {
      const Vec3 corner = uniform3(random, Vec3::Constant(-reach), Vec3::Constant(reach));
      scene.insertStill(boxAt(corner, uniform3(random, Vec3::Zero(), Vec3::Constant(reach))));
    }
    const Vec3 corner = uniform3(random, Vec3::Constant(-reach), Vec3::Constant(reach));
    scene.move(id, boxAt(corner, Vec3::Constant(reach)));
    ASSERT_NO_FATAL_FAILURE(scene.updateAndCheck()) << "tick " << tick;
  }
  EXPECT_EQ(scene.sweep().stillCount(), 1080u);
  EXPECT_GT(scene.begins, 500u);
}

TEST(SortAndSweepEdits, AStillBoxIsTakenOutWhereItWasPutIn) {
  Watched scene({boxAt(Vec3::Zero(), Vec3::Ones())});
  scene.insert(boxAt(Vec3::Zero(), Vec3::Ones()));
  scene.updateAndCheck();
  const StillId added = scene.insertStill(boxAt(Vec3(0.5, 0.5, 0.5), Vec3::Ones()));
  EXPECT_EQ(added, 1u);
  EXPECT_EQ(scene.sweep().pairCount(), 1u) << "staged until update()";
  scene.updateAndCheck();
  EXPECT_EQ(scene.sweep().pairCount(), 2u);
  scene.removeStill(0);
  const StillId other = scene.insertStill(boxAt(Vec3(9, 9, 9), Vec3::Ones()));
  EXPECT_EQ(other, 2u) << "an id is free only after the update that tells its end";
  scene.updateAndCheck();
  EXPECT_EQ(scene.sweep().ended().size(), 1u);
  EXPECT_EQ(scene.sweep().stillOverlapping(boxAt(Vec3::Zero(), Vec3::Constant(20))),
            (std::vector<StillId>{1, 2}));
  EXPECT_EQ(scene.insertStill(boxAt(Vec3::Zero(), Vec3::Ones())), 0u);
  scene.updateAndCheck();
}

TEST(SortAndSweepEdits, RefusesWhatIsNotThereAndWhatIsNoBox) {
  SortAndSweep sweep(std::vector<Box>{boxAt(Vec3::Zero(), Vec3::Ones())});
  EXPECT_THROW(sweep.insertStill(Box{}), std::invalid_argument);
  EXPECT_THROW(sweep.removeStill(1), std::invalid_argument);
  sweep.removeStill(0);
  EXPECT_THROW(sweep.removeStill(0), std::invalid_argument);
  const StillId passing = sweep.insertStill(boxAt(Vec3::Zero(), Vec3::Ones()));
  sweep.removeStill(passing);
  EXPECT_THROW(sweep.removeStill(passing), std::invalid_argument);
  sweep.update();
  EXPECT_EQ(sweep.stillCount(), 0u);
  EXPECT_THROW(sweep.removeStill(0), std::invalid_argument);
}

TEST(SortAndSweepEdits, AnEditDisturbsOnlyTheMoversBesideIt) {
  Random random(26);
  SortAndSweep sweep(furnishedHall(random, 20000, Vec3(100, 3, 100)));
  for (int k = 0; k < 100; ++k) {
    sweep.insert(boxAt(uniform3(random, Vec3::Zero(), Vec3(100, 1, 100)), Vec3(0.6, 1.75, 0.6)));
  }
  sweep.update();
  const std::uint64_t all = sweep.counters().cellsLaid;
  sweep.insertStill(boxAt(Vec3(50, 0, 50), Vec3::Constant(0.3)));
  sweep.update();
  EXPECT_EQ(sweep.counters().rebuilds, 0u);
  EXPECT_LT(sweep.counters().cellsLaid, all / 10);
}

TEST(BroadPhaseAudit, FindsNothingInARightSweepAndEachFaultThatIsMadeUp) {
  Random random(27);
  std::vector<Box> still = furnishedHall(random, 300, Vec3(10, 3, 10));
  SortAndSweep sweep(still);
  std::vector<std::pair<MoverId, Box>> movers;
  for (int k = 0; k < 40; ++k) {
    const Box box = boxAt(uniform3(random, Vec3::Zero(), Vec3(10, 1, 10)), Vec3(1.2, 1.75, 1.2));
    movers.emplace_back(sweep.insert(box), box);
  }
  sweep.update();
  EXPECT_TRUE(compareWithBruteForce(sweep, still, movers).right());
  EXPECT_EQ(compareWithBruteForce(sweep, still, movers).pairs, sweep.pairCount());

  // The audit is told of boxes that the sweep was not: what it holds is then wrong.
  ASSERT_FALSE(sweep.partners(movers[3].first).empty());
  const Box before = movers[3].second;
  movers[3].second = boxAt(Vec3::Constant(1e6), Vec3::Ones());
  const BroadPhaseAudit gone = compareWithBruteForce(sweep, still, movers);
  EXPECT_EQ(gone.extra.size(), sweep.partners(movers[3].first).size());
  EXPECT_TRUE(gone.missed.empty());
  movers[3].second = before;
  still.push_back(before);
  const BroadPhaseAudit come = compareWithBruteForce(sweep, still, movers);
  EXPECT_FALSE(come.missed.empty());
  EXPECT_TRUE(come.extra.empty());

  // Asked about one mover, it sees only the faults in which that mover takes part.
  still.pop_back();
  const std::vector<MoverId> one{movers[7].first};
  const BroadPhaseAudit some = compareWithBruteForce(sweep, still, movers, one);
  EXPECT_TRUE(some.right());
  EXPECT_EQ(some.pairs, sweep.partners(one[0]).size());
}

}  // namespace
}  // namespace enfilade::collision
