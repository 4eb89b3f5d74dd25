#include "server/worlds/work_pool.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <barrier>

namespace enfilade::server::testing {
namespace {

TEST(WorkPool, RunsEachPieceOfWorkOnceBeforeItFinishes) {
  constexpr std::size_t kPieces = 200;
  std::vector<std::atomic<int>> runs(kPieces);
  WorkPool pool;
  for (std::size_t first = 0; first < kPieces; first += 50) {
    std::vector<std::function<void()>> work;
    for (std::size_t i = first; i < first + 50; ++i) work.push_back([&runs, i] { ++runs[i]; });
    pool.post(std::move(work));
  }
  pool.post({});
  pool.finish();
  for (const std::atomic<int>& one : runs) EXPECT_EQ(one, 1);
}

TEST(WorkPool, SinglePiecesOfTwoCallersOverlap) {
  WorkPool pool(2);
  std::barrier<> both(2);  // each waits for the other
  for (int i = 0; i < 2; ++i) pool.post({[&both] { both.arrive_and_wait(); }});
  pool.finish();
}

}  // namespace
}  // namespace enfilade::server::testing
