// Static boxes are added and removed while dynamic boxes walk, rotate and jump; and the audit finds
// faults.

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

/// Random edits per tick: walking, rotating and jumping boxes; dynamic and static boxes added and
/// removed.
class RandomEdits {
 public:
  RandomEdits(std::uint64_t seed, std::size_t staticCount, const Vec3& extent)
      : random_(seed), extent_(extent), scene(makeFurnishedHall(random_, staticCount, extent)) {
    for (StaticId id = 0; id < staticCount; ++id) staticIds_.push_back(id);
  }

  void tick(int maxStaticEdits) {
    while (scene.getDynamicBoxes().size() < 30) addDynamicBox();
    for (const auto& [id, box] : std::map(scene.getDynamicBoxes())) moveDynamicBox(id, box);
    const int edits = drawInteger(random_, 0, maxStaticEdits);
    for (int k = 0; k < edits; ++k) editStaticBox();
  }

  std::size_t jumps = 0, staticsAdded = 0, staticsRemoved = 0, addedAndRemoved = 0;

 private:
  Aabb makeRandomStaticBox() {
    const double grow = drawInteger(random_, 0, 30) == 0 ? 10 : 1;
    const Vec3 corner = drawVector(random_, Vec3(-6, -3, -6), extent_ + Vec3(6, 3, 6));
    return makeBoxAt(corner, grow * drawVector(random_, Vec3::Zero(), Vec3(1.5, 1, 1.5)));
  }
  void addDynamicBox() {
    scene.insert(makeBoxAt(drawVector(random_, Vec3::Zero(), extent_), Vec3(0.6, 1.75, 0.6)));
  }
  void moveDynamicBox(ProxyId id, const Aabb& box) {
    const bool outside = !overlaps(box, makeBoxAt(Vec3::Zero(), extent_));
    const int action = outside ? 1 : drawInteger(random_, 0, 60);
    if (action == 0) {
      scene.remove(id);
    } else if (action == 1) {
      ++jumps;
      scene.move(id, makeBoxAt(drawVector(random_, Vec3::Zero(), extent_), box.size()));
    } else if (action < 30) {  // walks straight on; the id determines its heading
      const double x = 0.03 * (id % 5) - 0.06, z = 0.03 * (id % 7) - 0.09;
      scene.move(id, {box.min + Vec3(x, 0, z), box.max + Vec3(x, 0, z)});
    } else if (action < 50) {  // rotates: grows on one axis and shrinks on another
      const Vec3 by = drawVector(random_, Vec3::Constant(-0.03), Vec3::Constant(0.03));
      const Aabb resized{box.min + by, box.max - by};
      if (!resized.empty()) scene.move(id, resized);
    }
  }
  void editStaticBox() {
    if (drawInteger(random_, 0, 99) < (staticIds_.size() < 600 ? 60 : 50) || staticIds_.empty()) {
      ++staticsAdded;
      staticIds_.push_back(scene.insertStatic(makeRandomStaticBox()));
      if (drawInteger(random_, 0, 5) > 0) return;
      ++addedAndRemoved;  // added and removed within one tick
    }
    const auto at =
        static_cast<std::size_t>(drawInteger(random_, 0, static_cast<int>(staticIds_.size()) - 1));
    scene.removeStatic(staticIds_[at]);
    staticIds_[at] = staticIds_.back();
    staticIds_.pop_back();
    ++staticsRemoved;
  }

  Random random_;
  Vec3 extent_;
  std::vector<StaticId> staticIds_;

 public:
  CheckedSweep scene;
};

TEST(SortAndSweepEdits, EqualsBruteForceWhileEverythingComesGoesTurnsAndJumps) {
  std::size_t rebuilds = 0, editedTicks = 0, begins = 0;
  for (const std::uint64_t seed : {21, 22, 23, 24}) {
    RandomEdits turmoil(seed, 300 * (seed - 21), Vec3(14, 6, 14));  // the first starts empty
    for (int tick = 0; tick < 600; ++tick) {
      turmoil.tick(tick % 50 == 49 ? 200 : 4);
      ASSERT_NO_FATAL_FAILURE(turmoil.scene.updateAndCheck()) << "tick " << tick;
      rebuilds += turmoil.scene.getSweep().counters().rebuilds;
      editedTicks += turmoil.scene.getSweep().counters().staticEdits > 0 ? 1 : 0;
    }
    begins += turmoil.scene.pairsAdded;
    EXPECT_GT(turmoil.scene.pairsAdded, 200u);
    EXPECT_GT(turmoil.scene.pairsRemoved, 200u);
    EXPECT_GT(turmoil.scene.dynamicPairsAdded, 50u);
    EXPECT_GT(turmoil.jumps, 50u);
    EXPECT_GT(turmoil.staticsAdded, 300u);
    EXPECT_GT(turmoil.staticsRemoved, 300u);
    EXPECT_GT(turmoil.addedAndRemoved, 10u);
  }
  EXPECT_GT(begins, 4000u);
  EXPECT_GT(rebuilds, 5u);
  EXPECT_GT(editedTicks, 5 * rebuilds) << "too few edits in place";
}

TEST(SortAndSweepEdits, ASceneThatGrowsFromNothingFarBeyondItsFirstBoundsStaysExact) {
  Random random(25);
  CheckedSweep scene({});
  const ProxyId id = scene.insert(makeBoxAt(Vec3::Zero(), Vec3::Ones()));
  double reach = 1;
  for (int tick = 0; tick < 120; ++tick, reach *= 1.5) {  // to 1e21 m
    for (int k = 0; k < 9; ++k) {
      const Vec3 corner = drawVector(random, Vec3::Constant(-reach), Vec3::Constant(reach));
      scene.insertStatic(
          makeBoxAt(corner, drawVector(random, Vec3::Zero(), Vec3::Constant(reach))));
    }
    const Vec3 corner = drawVector(random, Vec3::Constant(-reach), Vec3::Constant(reach));
    scene.move(id, makeBoxAt(corner, Vec3::Constant(reach)));
    ASSERT_NO_FATAL_FAILURE(scene.updateAndCheck()) << "tick " << tick;
  }
  EXPECT_EQ(scene.getSweep().staticCount(), 1080u);
  EXPECT_GT(scene.pairsAdded, 500u);
}

TEST(SortAndSweepEdits, AStaticBoxIsRemovedFromItsCells) {
  CheckedSweep scene({makeBoxAt(Vec3::Zero(), Vec3::Ones())});
  scene.insert(makeBoxAt(Vec3::Zero(), Vec3::Ones()));
  scene.updateAndCheck();
  const StaticId added = scene.insertStatic(makeBoxAt(Vec3(0.5, 0.5, 0.5), Vec3::Ones()));
  EXPECT_EQ(added, 1u);
  EXPECT_EQ(scene.getSweep().pairCount(), 1u) << "staged until update()";
  scene.updateAndCheck();
  EXPECT_EQ(scene.getSweep().pairCount(), 2u);
  scene.removeStatic(0);
  const StaticId other = scene.insertStatic(makeBoxAt(Vec3(9, 9, 9), Vec3::Ones()));
  EXPECT_EQ(other, 2u) << "an id is free only after the update that reports its removal";
  scene.updateAndCheck();
  EXPECT_EQ(scene.getSweep().removedPairs().size(), 1u);
  EXPECT_EQ(scene.getSweep().overlapStatic(makeBoxAt(Vec3::Zero(), Vec3::Constant(20))),
            (std::vector<StaticId>{1, 2}));
  EXPECT_EQ(scene.insertStatic(makeBoxAt(Vec3::Zero(), Vec3::Ones())), 0u);
  scene.updateAndCheck();
}

TEST(SortAndSweepEdits, RefusesUnknownIdsAndInvalidBoxes) {
  SortAndSweep sweep(std::vector<Aabb>{makeBoxAt(Vec3::Zero(), Vec3::Ones())});
  EXPECT_THROW(sweep.insertStatic(Aabb{}), std::invalid_argument);
  EXPECT_THROW(sweep.removeStatic(1), std::invalid_argument);
  sweep.removeStatic(0);
  EXPECT_THROW(sweep.removeStatic(0), std::invalid_argument);
  const StaticId passing = sweep.insertStatic(makeBoxAt(Vec3::Zero(), Vec3::Ones()));
  sweep.removeStatic(passing);
  EXPECT_THROW(sweep.removeStatic(passing), std::invalid_argument);
  sweep.update();
  EXPECT_EQ(sweep.staticCount(), 0u);
  EXPECT_THROW(sweep.removeStatic(0), std::invalid_argument);
}

TEST(SortAndSweepEdits, AnEditAffectsOnlyNearbyProxies) {
  Random random(26);
  SortAndSweep sweep(makeFurnishedHall(random, 20000, Vec3(100, 3, 100)));
  for (int k = 0; k < 100; ++k) {
    sweep.insert(
        makeBoxAt(drawVector(random, Vec3::Zero(), Vec3(100, 1, 100)), Vec3(0.6, 1.75, 0.6)));
  }
  sweep.update();
  const std::uint64_t all = sweep.counters().windowsBuilt;
  sweep.insertStatic(makeBoxAt(Vec3(50, 0, 50), Vec3::Constant(0.3)));
  sweep.update();
  EXPECT_EQ(sweep.counters().rebuilds, 0u);
  EXPECT_LT(sweep.counters().windowsBuilt, all / 10);
}

TEST(BroadPhaseAudit, AcceptsACorrectSweepAndFindsEachInjectedFault) {
  Random random(27);
  std::vector<Aabb> staticBoxes = makeFurnishedHall(random, 300, Vec3(10, 3, 10));
  SortAndSweep sweep(staticBoxes);
  std::vector<std::pair<ProxyId, Aabb>> dynamicBoxes;
  for (int k = 0; k < 40; ++k) {
    const Aabb box =
        makeBoxAt(drawVector(random, Vec3::Zero(), Vec3(10, 1, 10)), Vec3(1.2, 1.75, 1.2));
    dynamicBoxes.emplace_back(sweep.insert(box), box);
  }
  sweep.update();
  const BroadPhaseAudit untouched = compareWithBruteForce(sweep, staticBoxes, dynamicBoxes);
  EXPECT_GT(untouched.pairs, 0u);
  EXPECT_TRUE(untouched.missed.empty() && untouched.extra.empty());
  EXPECT_EQ(compareWithBruteForce(sweep, staticBoxes, dynamicBoxes).pairs, sweep.pairCount());

  // The audit receives boxes that the sweep did not: the state of the sweep is then wrong.
  ASSERT_FALSE(sweep.getOverlaps(dynamicBoxes[3].first).empty());
  const Aabb before = dynamicBoxes[3].second;
  dynamicBoxes[3].second = makeBoxAt(Vec3::Constant(1e6), Vec3::Ones());
  const BroadPhaseAudit gone = compareWithBruteForce(sweep, staticBoxes, dynamicBoxes);
  EXPECT_EQ(gone.extra.size(), sweep.getOverlaps(dynamicBoxes[3].first).size());
  EXPECT_TRUE(gone.missed.empty());
  dynamicBoxes[3].second = before;
  staticBoxes.push_back(before);
  const BroadPhaseAudit come = compareWithBruteForce(sweep, staticBoxes, dynamicBoxes);
  EXPECT_FALSE(come.missed.empty());
  EXPECT_TRUE(come.extra.empty());

  // An audit of one proxy reports only the faults of that proxy.
  staticBoxes.pop_back();
  const std::vector<ProxyId> one{dynamicBoxes[7].first};
  const BroadPhaseAudit some = compareWithBruteForce(sweep, staticBoxes, dynamicBoxes, one);
  EXPECT_TRUE(some.missed.empty() && some.extra.empty());
  EXPECT_EQ(some.pairs, sweep.getOverlaps(one[0]).size());
}

}  // namespace
}  // namespace enfilade::collision
