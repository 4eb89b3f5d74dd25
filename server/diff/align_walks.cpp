// Needleman and Wunsch's alignment (1970): of all ways to pair two lists in their order, the one
// whose costs are least, where leaving two out costs as much as pairing them at kSamePlace.
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "protocol/mcap/records.hpp"
#include "server/diff/walk_difference.hpp"

namespace enfilade::server {
namespace {

/// Beyond this the table would take some 100 MB; longer lists are cut into pieces by time.
constexpr std::size_t kMostRows = 2000;
constexpr double kSecond = 1e-3;  // metres that a second counts: it decides between equal places

double costOf(const Happening& before, const Happening& after) {
  const double apart = (before.point - after.point).norm();
  if (!(apart < kSamePlace)) return 2 * kSamePlace;
  return std::min(apart + kSecond * std::abs(before.time - after.time), kSamePlace * 0.999);
}

struct Range {
  std::size_t first, last;
};

using Pairs = std::vector<std::pair<std::size_t, std::size_t>>;

void align(const std::vector<Happening>& before, Range b, const std::vector<Happening>& after,
           Range a, Pairs& into) {
  const std::size_t rows = b.last - b.first + 1, columns = a.last - a.first + 1;
  std::vector<double> cost(rows * columns);
  const auto at = [&](std::size_t i, std::size_t j) -> double& { return cost[i * columns + j]; };
  constexpr double kLeftOut = kSamePlace / 2;
  for (std::size_t i = 0; i < rows; ++i) {
    for (std::size_t j = 0; j < columns; ++j) {
      double best = i + j == 0 ? 0 : 1e300;
      if (i > 0) best = std::min(best, at(i - 1, j) + kLeftOut);
      if (j > 0) best = std::min(best, at(i, j - 1) + kLeftOut);
      if (i > 0 && j > 0)
        best = std::min(best,
                        at(i - 1, j - 1) + costOf(before[b.first + i - 1], after[a.first + j - 1]));
      at(i, j) = best;
    }
  }
  std::size_t i = rows - 1, j = columns - 1;
  const std::size_t old = into.size();
  while (i > 0 && j > 0) {
    const double paired = costOf(before[b.first + i - 1], after[a.first + j - 1]);
    if (paired < 2 * kSamePlace && at(i, j) == at(i - 1, j - 1) + paired) {
      into.emplace_back(b.first + --i, a.first + --j);
    } else if (at(i, j) == at(i - 1, j) + kLeftOut) {
      --i;
    } else {
      --j;
    }
  }
  std::reverse(into.begin() + static_cast<std::ptrdiff_t>(old), into.end());
}

std::size_t firstAfter(const std::vector<Happening>& list, double time) {
  return static_cast<std::size_t>(
      std::partition_point(list.begin(), list.end(),
                           [&](const Happening& one) { return one.time <= time; }) -
      list.begin());
}

}  // namespace

Pairs matchedHappenings(const std::vector<Happening>& before, const std::vector<Happening>& after) {
  Pairs pairs;
  Range b{0, 0}, a{0, 0};
  while (b.first < before.size() || a.first < after.size()) {
    b.last = std::min(before.size(), b.first + kMostRows);
    a.last = std::min(after.size(), a.first + kMostRows);
    // Both pieces end at the same time, that of the one that is full first.
    if (b.last < before.size() || a.last < after.size()) {
      double until = 1e300;
      if (b.last < before.size()) until = std::min(until, before[b.last - 1].time);
      if (a.last < after.size()) until = std::min(until, after[a.last - 1].time);
      b.last = std::min(b.last, firstAfter(before, until));
      a.last = std::min(a.last, firstAfter(after, until));
      b.last = std::max(b.last, b.first);
      a.last = std::max(a.last, a.first);
      if (b.last == b.first && a.last == a.first)  // as no recorder writes them: times that descend
        throw protocol::mcap::RecordingError("the recorded times do not ascend");
    }
    align(before, b, after, a, pairs);
    b.first = b.last;
    a.first = a.last;
  }
  return pairs;
}

}  // namespace enfilade::server
