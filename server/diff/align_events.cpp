#include "server/diff/align_events.hpp"

#include <algorithm>
#include <cmath>

#include "collision/assert.hpp"
#include "protocol/mcap/records.hpp"

namespace enfilade::server {
namespace {

/// Longer lists are split by time, because the table would exceed about 100 MB.
constexpr std::size_t kMaxRows = 2000;
constexpr double kTimeWeight = 1e-3;  // metres per second: breaks ties

double computeCost(const WalkEvent& before, const WalkEvent& after) {
  const double distance = (before.point - after.point).norm();
  if (!(distance < kMaxMatchDistance)) return 2 * kMaxMatchDistance;
  return std::min(distance + kTimeWeight * std::abs(before.time - after.time),
                  kMaxMatchDistance * 0.999);
}

struct Range {
  std::size_t first, last;
};

using IndexPairs = std::vector<std::pair<std::size_t, std::size_t>>;

void alignRange(const std::vector<WalkEvent>& before, Range b, const std::vector<WalkEvent>& after,
                Range a, IndexPairs& into) {
  const std::size_t rows = b.last - b.first + 1, columns = a.last - a.first + 1;
  std::vector<double> cost(rows * columns);
  const auto at = [&](std::size_t i, std::size_t j) -> double& { return cost[i * columns + j]; };
  constexpr double kUnpairedCost = kMaxMatchDistance / 2;
  for (std::size_t i = 0; i < rows; ++i) {
    for (std::size_t j = 0; j < columns; ++j) {
      double best = i + j == 0 ? 0 : 1e300;
      if (i > 0) best = std::min(best, at(i - 1, j) + kUnpairedCost);
      if (j > 0) best = std::min(best, at(i, j - 1) + kUnpairedCost);
      if (i > 0 && j > 0)
        best = std::min(
            best, at(i - 1, j - 1) + computeCost(before[b.first + i - 1], after[a.first + j - 1]));
      at(i, j) = best;
    }
  }
  std::size_t i = rows - 1, j = columns - 1;
  const std::size_t old = into.size();
  while (i > 0 && j > 0) {
    const double paired = computeCost(before[b.first + i - 1], after[a.first + j - 1]);
    if (paired < 2 * kMaxMatchDistance && at(i, j) == at(i - 1, j - 1) + paired) {
      into.emplace_back(b.first + --i, a.first + --j);
    } else if (at(i, j) == at(i - 1, j) + kUnpairedCost) {
      --i;
    } else {
      --j;
    }
  }
  std::reverse(into.begin() + static_cast<std::ptrdiff_t>(old), into.end());
}

std::size_t findFirstAfter(const std::vector<WalkEvent>& list, double time) {
  return static_cast<std::size_t>(
      std::partition_point(list.begin(), list.end(),
                           [&](const WalkEvent& one) { return one.time <= time; }) -
      list.begin());
}

}  // namespace

IndexPairs alignEvents(const std::vector<WalkEvent>& before, const std::vector<WalkEvent>& after) {
  IndexPairs pairs;
  Range b{0, 0}, a{0, 0};
  while (b.first < before.size() || a.first < after.size()) {
    b.last = std::min(before.size(), b.first + kMaxRows);
    a.last = std::min(after.size(), a.first + kMaxRows);
    // Both pieces end at the same time: the end of the piece that is full first.
    if (b.last < before.size() || a.last < after.size()) {
      double until = 1e300;
      if (b.last < before.size()) until = std::min(until, before[b.last - 1].time);
      if (a.last < after.size()) until = std::min(until, after[a.last - 1].time);
      b.last = std::min(b.last, findFirstAfter(before, until));
      a.last = std::min(a.last, findFirstAfter(after, until));
      b.last = std::max(b.last, b.first);
      a.last = std::max(a.last, a.first);
      if (b.last == b.first && a.last == a.first)  // descending times, which no recorder writes
        throw protocol::mcap::RecordingError("the recorded times do not ascend");
    }
    alignRange(before, b, after, a, pairs);
    b.first = b.last;
    a.first = a.last;
  }
  ENFILADE_ASSERT(std::ranges::is_sorted(pairs));
  return pairs;
}

}  // namespace enfilade::server
