#include "scene/base/thread_pool.hpp"

#include <gtest/gtest.h>

#include <numeric>
#include <random>
#include <stdexcept>

#include "scene/physics/graph_coloring.hpp"

namespace enfilade::scene {
namespace {

TEST(ThreadPool, EachIndexIsDoneOnceByAnyNumberOfThreads) {
  for (const int threads : {1, 2, 3, 7}) {
    ThreadPool workers(threads);
    EXPECT_EQ(workers.threadCount(), threads);
    for (const std::size_t size : {0u, 1u, 15u, 16u, 17u, 1000u}) {
      std::vector<int> done(size, 0);
      workers.parallelFor(size, 16, [&](std::size_t from, std::size_t to) {
        for (std::size_t i = from; i < to; ++i) ++done[i];
      });
      EXPECT_EQ(std::accumulate(done.begin(), done.end(), std::size_t{0}), size);
      EXPECT_TRUE(std::all_of(done.begin(), done.end(), [](int n) { return n == 1; }));
    }
  }
}

TEST(ThreadPool, ManyShortLoopsRunInSequence) {
  ThreadPool workers(2);
  std::vector<std::size_t> sums(100, 0);
  for (int round = 0; round < 2000; ++round)
    workers.parallelFor(sums.size(), 8, [&](std::size_t from, std::size_t to) {
      for (std::size_t i = from; i < to; ++i) sums[i] += i;
    });
  for (std::size_t i = 0; i < sums.size(); ++i) EXPECT_EQ(sums[i], 2000 * i);
}

TEST(ThreadPool, AnExceptionComesBackAndTheNextLoopRuns) {
  ThreadPool workers(2);
  const auto throwAt = [&](std::size_t bad) {
    workers.parallelFor(64, 8, [&](std::size_t from, std::size_t to) {
      if (from <= bad && bad < to) throw std::runtime_error("here");
    });
  };
  EXPECT_THROW(throwAt(3), std::runtime_error);
  EXPECT_THROW(throwAt(11), std::runtime_error);
  EXPECT_NO_THROW(throwAt(64));
}

TEST(GraphColoring, PatchesOfOneColourShareNothingThatMoves) {
  std::mt19937 random(3);
  std::vector<std::uint8_t> moves(200, 1);
  moves[0] = 0;  // a floor
  std::vector<ContactConstraint> patches(1500);
  for (ContactConstraint& patch : patches) {
    patch.a = static_cast<std::uint32_t>(random() % (random() % 3 == 0 ? 1 : 200));
    patch.b = (patch.a + 1 + static_cast<std::uint32_t>(random() % 199)) % 200;
  }
  const ConstraintColoring colouring = colorConstraints(patches, moves);
  ASSERT_EQ(colouring.order.size(), patches.size());
  ASSERT_EQ(colouring.ends.back(), patches.size());
  EXPECT_GT(colouring.ends.size(), 5u);
  std::vector<int> seen(patches.size(), 0);
  std::size_t from = 0;
  for (std::size_t c = 0; c < colouring.ends.size(); ++c) {
    std::vector<int> users(moves.size(), 0);
    for (std::size_t k = from; k < colouring.ends[c]; ++k) {
      const ContactConstraint& patch = patches[colouring.order[k]];
      ++seen[colouring.order[k]];
      ++users[patch.a], ++users[patch.b];
    }
    users[0] = 0;
    if (c + 1 < colouring.ends.size()) {
      EXPECT_LE(*std::max_element(users.begin(), users.end()), 1) << c;
    }
    from = colouring.ends[c];
  }
  EXPECT_TRUE(std::all_of(seen.begin(), seen.end(), [](int n) { return n == 1; }));
}

TEST(GraphColoring, AFewPatchesThatShareABodyKeepTheirOrder) {
  std::vector<ContactConstraint> patches(5);
  for (ContactConstraint& patch : patches) patch.b = 1;
  patches[2].a = 2, patches[2].b = 3;  // disjoint from all others
  const std::vector<std::uint8_t> moves(4, 1);
  const ConstraintColoring colouring = colorConstraints(patches, moves);
  EXPECT_EQ(colouring.order, (std::vector<std::uint32_t>{0, 2, 1, 3, 4}));
  EXPECT_EQ(colouring.ends, (std::vector<std::uint32_t>{2, 3, 4, 5, 5}));
}

}  // namespace
}  // namespace enfilade::scene
