// Tests of batch updates, which find all dynamic pairs from scratch because coherence is lost. The
// same pairs and changes as by brute force, and a return to the endpoint lists.
#include <gtest/gtest.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "tests/collision/checked_sweep.hpp"

namespace enfilade::collision {
namespace {

constexpr int kProxies = 300;

class BatchedSweep : public ::testing::Test {
 protected:
  Aabb makeRandomBox(double largest = 1) {
    const Vec3 size = drawVector(random_, Vec3::Constant(0.05), Vec3::Constant(largest));
    return makeBoxAt(drawVector(random_, Vec3::Zero(), Vec3::Constant(9)), size);
  }
  void insertAll(double largest = 1) {
    for (int k = 0; k < kProxies; ++k) ids_.push_back(checked_.insert(makeRandomBox(largest)));
  }
  void shift(ProxyId id, double step) {
    const Vec3 by = drawVector(random_, Vec3::Constant(-step), Vec3::Constant(step));
    const Aabb box = checked_.getDynamicBoxes()[id];
    checked_.move(id, {box.min + by, box.max + by});
  }
  void updateAndCheck() {
    ASSERT_NO_FATAL_FAILURE(checked_.updateAndCheck());
    batched_ = checked_.getSweep().counters().batched;
  }
  void expectTheAuditFindsInjectedFaults(ProxyId first);

  Random random_{7};
  CheckedSweep checked_{makeFurnishedHall(random_, 60, Vec3::Constant(10))};
  std::vector<ProxyId> ids_;
  std::uint64_t batched_ = 0;  ///< of the last update
};

/// The audit accepts the sweep, and finds faults injected at a pair of proxies from `first` on.
void BatchedSweep::expectTheAuditFindsInjectedFaults(ProxyId first) {
  const SortAndSweep& sweep = checked_.getSweep();
  std::vector<std::pair<ProxyId, Aabb>> boxes(checked_.getDynamicBoxes().begin(),
                                              checked_.getDynamicBoxes().end());
  const auto audit = [&] { return compareWithBruteForce(sweep, checked_.getStaticBoxes(), boxes); };
  const BroadPhaseAudit untouched = audit();
  EXPECT_GT(untouched.pairs, 0u);
  EXPECT_EQ(untouched.pairs, sweep.pairCount());
  EXPECT_TRUE(untouched.missed.empty() && untouched.extra.empty());

  // The audit receives boxes that the sweep did not: the state of the sweep is then wrong.
  const auto found = std::ranges::find_if(boxes, [&](const auto& proxy) {
    const auto dynamicOverlaps = sweep.getDynamicOverlaps(proxy.first);
    return proxy.first >= first && !dynamicOverlaps.empty() && dynamicOverlaps.back().id >= first;
  });
  ASSERT_NE(found, boxes.end());
  const auto [id, box] = *found;
  const std::size_t overlapCount = sweep.getOverlaps(id).size();
  found->second = makeBoxAt(Vec3::Constant(1e6), Vec3::Ones());
  const BroadPhaseAudit gone = audit();
  EXPECT_EQ(gone.extra.size(), overlapCount);
  EXPECT_TRUE(std::ranges::any_of(gone.extra, &ProxyPair::otherIsDynamic));
  EXPECT_TRUE(gone.missed.empty());
  found->second = box;
  const ProxyId unknown = boxes.back().first + 1;
  boxes.emplace_back(unknown, box);
  const BroadPhaseAudit come = audit();
  EXPECT_EQ(come.missed.size(), overlapCount + 1) << "the proxy itself, and what it overlaps";
  EXPECT_EQ(std::ranges::count(come.missed, ProxyPair{id, unknown, true}), 1);
  EXPECT_TRUE(come.extra.empty());
}

TEST_F(BatchedSweep, EqualsBruteForceWhileAllProxiesMoveFast) {
  insertAll();
  int batches = 0;
  for (int tick = 0; tick < 150; ++tick) {
    for (const ProxyId id : ids_) shift(id, 0.4);
    updateAndCheck();
    if (HasFatalFailure()) return;
    batches += batched_ > 0 ? 1 : 0;
  }
  EXPECT_EQ(batches, 150);
  EXPECT_GT(checked_.dynamicPairsAdded, 600u);
}

TEST_F(BatchedSweep, EqualsBruteForceWithSizesOfManyMagnitudes) {
  insertAll(0.3);
  for (int k = 0; k < 12; ++k) ids_.push_back(checked_.insert(makeRandomBox(6)));
  for (int tick = 0; tick < 60; ++tick) {
    for (const ProxyId id : ids_) {
      if (drawInteger(random_, 0, 9) > 0) {
        shift(id, 0.3);
      } else {
        checked_.move(id, makeRandomBox(tick % 3 == 0 ? 5 : 0.2));
      }
    }
    updateAndCheck();
    if (HasFatalFailure()) return;
    EXPECT_GT(batched_, 0u);
  }
}

TEST_F(BatchedSweep, ProxiesThatRestAreLeftOutUntilTheyMove) {
  insertAll();
  const std::size_t dynamicBoxes = 100;
  for (int tick = 0; tick < 200; ++tick) {
    for (std::size_t k = 0; k < dynamicBoxes; ++k) shift(ids_[k], 0.4);
    if (tick > 100 && tick % 7 == 0) {  // resting ones move a little, two at once, or jump
      const auto rested = dynamicBoxes + static_cast<std::size_t>(drawInteger(random_, 0, 198));
      shift(ids_[rested], 0.2);
      shift(ids_[rested + 1], tick % 3 == 0 ? 5 : 0.01);
    }
    updateAndCheck();
    if (HasFatalFailure()) return;
    if (tick == 100) {
      EXPECT_EQ(batched_, dynamicBoxes);
    }
    if (tick == 106) {
      EXPECT_EQ(batched_, dynamicBoxes + 2);
    }
  }
}

TEST_F(BatchedSweep, ProxiesComeAndGoWhileOthersRestOrMove) {
  insertAll();
  for (int tick = 0; tick < 250; ++tick) {
    for (std::size_t k = 0; k < 90; ++k) shift(ids_[k], 0.4);
    for (int change = 0; change < 2; ++change) {
      const auto k = static_cast<std::size_t>(drawInteger(random_, 0, kProxies - 1));
      checked_.remove(ids_[k]);
      if (change == 1) shift(ids_[k == 0 ? 1 : 0], 0.1);
      ids_[k] = checked_.insert(makeRandomBox());
    }
    if (tick % 20 == 0) checked_.insertStatic(makeRandomBox());
    updateAndCheck();
    if (HasFatalFailure()) return;
  }
  EXPECT_GT(batched_, 0u);
}

TEST_F(BatchedSweep, ReturnsToTheListsWhenTheMotionIsSlowAndToBatchesWhenItIsFast) {
  insertAll();
  for (int round = 0; round < 2; ++round) {
    for (int tick = 0; tick < 40; ++tick) {
      for (const ProxyId id : ids_) shift(id, 0.4);
      updateAndCheck();
      if (HasFatalFailure()) return;
    }
    EXPECT_GT(batched_, 0u);
    for (int tick = 0; tick < 140; ++tick) {
      for (const ProxyId id : ids_) shift(id, 0.0005);
      updateAndCheck();
      if (HasFatalFailure()) return;
    }
    EXPECT_EQ(batched_, 0u);
  }
}

TEST_F(BatchedSweep, FewProxiesAreNeverABatch) {
  for (int k = 0; k < 40; ++k) ids_.push_back(checked_.insert(makeRandomBox()));
  for (int tick = 0; tick < 40; ++tick) {
    for (const ProxyId id : ids_) shift(id, 0.8);
    updateAndCheck();
    EXPECT_EQ(batched_, 0u);
  }
}

TEST_F(BatchedSweep, LeavesTheBatchWhenMostProxiesAreRemoved) {
  insertAll();
  for (int tick = 0; tick < 10; ++tick) {
    for (const ProxyId id : ids_) shift(id, 0.4);
    updateAndCheck();
  }
  EXPECT_GT(batched_, 0u);
  while (ids_.size() > 20) {
    checked_.remove(ids_.back());
    ids_.pop_back();
  }
  for (int tick = 0; tick < 40; ++tick) {
    for (const ProxyId id : ids_) shift(id, 0.4);
    updateAndCheck();
  }
  EXPECT_EQ(batched_, 0u);
}

TEST_F(BatchedSweep, TheAuditAcceptsABatchAndFindsEachInjectedFault) {
  insertAll();
  for (int tick = 0; tick < 5; ++tick) {
    for (const ProxyId id : ids_) shift(id, 0.4);
    updateAndCheck();
    if (HasFatalFailure()) return;
  }
  ASSERT_EQ(batched_, static_cast<std::uint64_t>(kProxies));
  expectTheAuditFindsInjectedFaults(0);
}

TEST_F(BatchedSweep, TheAuditFindsFaultsOfProxiesThatRest) {
  insertAll();
  constexpr std::size_t kMoving = 100;
  for (int tick = 0; tick < 100; ++tick) {
    for (std::size_t k = 0; k < kMoving; ++k) shift(ids_[k], 0.4);
    updateAndCheck();
    if (HasFatalFailure()) return;
  }
  ASSERT_EQ(batched_, kMoving);
  expectTheAuditFindsInjectedFaults(ids_[kMoving]);
}

TEST_F(BatchedSweep, AnIdleBatchDoesNothing) {
  insertAll();
  updateAndCheck();
  EXPECT_EQ(batched_, static_cast<std::uint64_t>(kProxies));
  updateAndCheck();
  EXPECT_EQ(batched_, 0u);
  EXPECT_EQ(checked_.getSweep().counters().aabbTests, 0u);
}

}  // namespace
}  // namespace enfilade::collision
