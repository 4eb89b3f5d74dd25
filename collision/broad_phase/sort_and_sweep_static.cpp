// Dynamic proxies against static boxes: brackets, endpoint crossings and window builds. Also the
// insertion and removal of static boxes. The steps are at the head of sort_and_sweep.cpp.
#include "collision/broad_phase/sort_and_sweep_static.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "collision/assert.hpp"
#include "collision/broad_phase/sort_and_sweep_pairs.hpp"

namespace enfilade::collision {
namespace {

using Row = StaticGrid::Row;

// Ticks of predicted motion that a window covers, at the current velocity.
constexpr double kWindowTicks = 40;
// One proxy in this many is checked per tick. Its window is rebuilt if the proxy is predicted to
// leave it before the next check.
constexpr std::size_t kRefreshInterval = 32;
// Slack for a change of direction: this many ticks at the maximum speed of all signed axes, plus a
// fraction of the proxy's largest size. If the motion is unknown, the slack is the whole size. It
// is unknown for new proxies and after a motion of more than the size per tick (a jump).
constexpr double kSlackTicks = 3;
constexpr double kSlackSizeRatio = 1.0 / 64;
// Maximum margin of a window, relative to the proxy's size or to the edge of the finest cells. It
// prevents fast proxies from gathering half of the scene.
constexpr double kMaxMarginSizeRatio = 1.5;
constexpr double kMaxMarginEdgeRatio = 0.5;
// Above this number of edits in one update all windows are rebuilt.
constexpr std::size_t kSmallEditThreshold = 256;

constexpr double kMaxDouble = std::numeric_limits<double>::max();

bool isWithin(const SignedBounds& low, const SignedBounds& maxEndpoints, const SignedBounds& high) {
  return (findGreater(low, maxEndpoints) | (0x3f & ~findGreater(high, maxEndpoints))) == 0;
}

/// Sets the bracket of signed axis `k` to the endpoints adjacent to the proxy's own.
void setBracket(DynamicProxy& proxy, std::size_t k) {
  proxy.bracketLow[k] = proxy.window.endpointBefore(k);
  proxy.bracketHigh[k] = proxy.window.endpointAfter(k);
}

SignedBounds extrapolate(const SignedBounds& maxEndpoints, const SignedBounds& velocity,
                         double ticks) {
  SignedBounds later = maxEndpoints;
  for (std::size_t k = 0; k < 6; ++k) later[k] += ticks * velocity[k];
  return later;
}

// ---- building a window -------------------------------------------------------------------------

SignedBounds estimateVelocity(const SweepState& sweep, ProxyId id) {
  const DynamicProxy& proxy = sweep.proxies[id];
  const SignedBounds& maxEndpoints = sweep.proxyMaxEndpoints[id];
  SignedBounds velocity = proxy.velocity;
  if (sweep.tick == proxy.builtAt) return velocity;
  const double share = 1 / static_cast<double>(sweep.tick - proxy.builtAt);
  for (std::size_t k = 0; k < 6; ++k)
    velocity[k] = (maxEndpoints[k] - proxy.builtMaxEndpoints[k]) * share;
  return velocity;
}

void setWindowBounds(SweepState& sweep, ProxyId id) {
  DynamicProxy& proxy = sweep.proxies[id];
  const SignedBounds& maxEndpoints = sweep.proxyMaxEndpoints[id];
  proxy.velocity = estimateVelocity(sweep, id);
  proxy.builtMaxEndpoints = maxEndpoints;
  proxy.builtAt = sweep.tick;
  double maxSpeed = 0, maxSize = 0;
  for (const double velocity : proxy.velocity) maxSpeed = std::max(maxSpeed, std::abs(velocity));
  for (std::size_t axis = 0; axis < 3; ++axis)
    maxSize = std::max(maxSize, maxEndpoints[axis] + maxEndpoints[axis + 3]);
  const bool unknown = proxy.state == ProxyState::added || (maxSize > 0 && maxSpeed > maxSize);
  if (unknown) proxy.velocity.fill(0);
  const double slack = unknown ? maxSize : kSlackTicks * maxSpeed + kSlackSizeRatio * maxSize;
  const double minMargin = kMaxMarginEdgeRatio * sweep.staticGrid.grid().edge();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double size = maxEndpoints[axis] + maxEndpoints[axis + 3];
    const double maxMargin = std::max(kMaxMarginSizeRatio * size, minMargin);
    for (const std::size_t k : {axis, axis + 3}) {
      const double drift = kWindowTicks * proxy.velocity[k];
      const double ahead = std::min(slack + std::max(drift, 0.0), maxMargin);
      const double behind = std::min(slack - std::min(drift, 0.0), maxMargin);
      double upperBound = maxEndpoints[k] + ahead;
      if (!(upperBound > maxEndpoints[k])) upperBound = std::nextafter(maxEndpoints[k], kMaxDouble);
      proxy.window.maxBounds[k] = std::min(upperBound, kMaxDouble);
      proxy.window.minBounds[k] = std::max(maxEndpoints[k] - behind, -kMaxDouble);
    }
  }
}

// ---- from tick to tick -------------------------------------------------------------------------

/// Crosses at least one endpoint inward; false if the proxy has left its window.
bool crossInward(SweepState& sweep, ProxyId id, std::size_t k) {
  DynamicProxy& proxy = sweep.proxies[id];
  ProxyWindow& window = proxy.window;
  const double maxEndpoint = sweep.proxyMaxEndpoints[id][k];
  do {
    ENFILADE_ASSERT(window.next[k] > 0);
    const std::uint32_t passed = window.endpoints[window.next[k] - 1].staticIndex;
    if (passed == ProxyWindow::kSentinel) return false;
    ++sweep.counters.swaps;
    ProxyWindow::StaticProxy& box = window.statics[passed];
    ENFILADE_ASSERT((box.separatedMask >> k & 1) == 0);
    if (box.separatedMask == 0) removeStaticOverlap(sweep, id, box.id);
    box.separatedMask = static_cast<std::uint8_t>(box.separatedMask | 1u << k);
    --window.next[k];
  } while (window.endpointBefore(k) > maxEndpoint);
  setBracket(proxy, k);
  return true;
}

/// Crosses at least one endpoint outward; false if the proxy has left its window.
bool crossOutward(SweepState& sweep, ProxyId id, std::size_t k) {
  DynamicProxy& proxy = sweep.proxies[id];
  ProxyWindow& window = proxy.window;
  const double maxEndpoint = sweep.proxyMaxEndpoints[id][k];
  do {
    const std::uint32_t passed = window.endpoints[window.next[k]].staticIndex;
    if (passed == ProxyWindow::kSentinel) return false;
    ++sweep.counters.swaps;
    ProxyWindow::StaticProxy& box = window.statics[passed];
    ENFILADE_ASSERT((box.separatedMask >> k & 1) == 1);
    box.separatedMask = static_cast<std::uint8_t>(box.separatedMask & ~(1u << k));
    if (box.separatedMask == 0) addStaticOverlap(sweep, id, box.id);
    ++window.next[k];
  } while (window.endpointAfter(k) <= maxEndpoint);
  setBracket(proxy, k);
  return true;
}

/// Crosses inward before outward, so that each pair is reported at most once.
void crossEndpoints(SweepState& sweep, ProxyId id) {
  const DynamicProxy& proxy = sweep.proxies[id];
  const unsigned inward = findGreater(proxy.bracketLow, sweep.proxyMaxEndpoints[id]);
  const unsigned outward = 0x3f & ~findGreater(proxy.bracketHigh, sweep.proxyMaxEndpoints[id]);
  for (unsigned bits = inward | outward << 6; bits != 0; bits &= bits - 1) {
    const auto k = static_cast<std::size_t>(std::countr_zero(bits));
    if (!(k < 6 ? crossInward(sweep, id, k) : crossOutward(sweep, id, k - 6))) {
      rebuildWindow(sweep, id);
      return;
    }
  }
}

// ---- insertion and removal of static boxes -----------------------------------------------------

void rebuildStaticGrid(SweepState& sweep) {
  ++sweep.counters.rebuilds;
  std::vector<Aabb> boxes;
  std::vector<StaticId> ids;
  for (StaticId id = 0; id < sweep.staticIdCount; ++id) {
    const Row row =
        sweep.pendingRemovals.contains(id) ? StaticGrid::kNoRow : sweep.staticGrid.findRow(id);
    if (row == StaticGrid::kNoRow) continue;
    boxes.push_back(makeAabbFromMinEndpoints(sweep.staticGrid.minEndpoints(row)));
    ids.push_back(id);
  }
  for (const auto& [id, box] : sweep.pendingInserts) {
    boxes.push_back(box);
    ids.push_back(id);
  }
  sweep.staticGrid = StaticGrid(boxes, ids);
}

}  // namespace

void rebuildWindow(SweepState& sweep, ProxyId id) {
  DynamicProxy& proxy = sweep.proxies[id];
  ENFILADE_ASSERT(proxy.state == ProxyState::added || proxy.state == ProxyState::active);
  const SignedBounds before = proxy.window.maxBounds;
  setWindowBounds(sweep, id);
  if (proxy.state == ProxyState::active) {
    for (std::size_t k = 0; k < 6; ++k)
      sweep.travel[k % 3] += std::abs(proxy.window.maxBounds[k] - before[k]);
  }
  sweep.rows.count = 0;
  sweep.staticGrid.gather(proxy.window.maxBounds, sweep.rows);
  for (const Row row : sweep.rows.all()) __builtin_prefetch(&sweep.staticGrid.minEndpoints(row));
  sweep.counters.aabbTests += sweep.rows.count;
  ++sweep.counters.windowsBuilt;
  std::size_t kept = 0;
  for (const Row row : sweep.rows.all()) {
    sweep.rows.rows[kept] = row;
    kept += overlaps(sweep.staticGrid.minEndpoints(row), proxy.window.maxBounds) ? 1 : 0;
  }
  proxy.window.build(sweep.staticGrid, std::span(sweep.rows.rows).first(kept),
                     sweep.proxyMaxEndpoints[id], sweep.overlappingStatics);
  for (std::size_t k = 0; k < 6; ++k) setBracket(proxy, k);
  replaceStaticOverlaps(sweep, id);
  if (proxy.rebuilt) return;
  proxy.rebuilt = true;
  sweep.rebuilt.push_back(id);
}

void refreshWindows(SweepState& sweep) {
  if (sweep.proxies.empty()) return;
  std::size_t visits = (sweep.proxies.size() + kRefreshInterval - 1) / kRefreshInterval;
  const double ticks = static_cast<double>(sweep.proxies.size()) / static_cast<double>(visits);
  visits -= std::min(visits, sweep.rebuilt.size());  // forced rebuilds count as refreshes
  for (std::size_t k = 0; k < visits; ++k) {
    const auto id = static_cast<ProxyId>(sweep.nextRefreshed++ % sweep.proxies.size());
    const DynamicProxy& proxy = sweep.proxies[id];
    if (proxy.state != ProxyState::active || proxy.rebuilt) continue;
    const SignedBounds later =
        extrapolate(sweep.proxyMaxEndpoints[id], estimateVelocity(sweep, id), ticks);
    if (!isWithin(proxy.window.minBounds, later, proxy.window.maxBounds)) rebuildWindow(sweep, id);
  }
}

void updateStaticOverlaps(SweepState& sweep) {
  for (std::size_t k = 0; k < sweep.outsideBrackets.size(); ++k) {
    if (k + kPrefetchDistance < sweep.outsideBrackets.size())
      sweep.proxies[sweep.outsideBrackets[k + kPrefetchDistance]].window.prefetch();
    DynamicProxy& proxy = sweep.proxies[sweep.outsideBrackets[k]];
    proxy.leftBrackets = false;
    if (proxy.state == ProxyState::active) crossEndpoints(sweep, sweep.outsideBrackets[k]);
  }
}

void applyStaticEdits(SweepState& sweep) {
  const std::size_t edits = sweep.pendingInserts.size() + sweep.pendingRemovals.size();
  if (edits == 0) return;
  sweep.counters.staticEdits = edits;
  std::vector<SignedBounds> edited;
  for (const StaticId id : sweep.pendingRemovals) {
    const Row row = sweep.staticGrid.findRow(id);
    ENFILADE_ASSERT(row != StaticGrid::kNoRow);
    edited.push_back(sweep.staticGrid.minEndpoints(row));
  }
  for (const auto& [id, box] : sweep.pendingInserts) edited.push_back(toMinEndpoints(box));
  if (sweep.staticGrid.hasCapacityFor(edits)) {
    for (const StaticId id : sweep.pendingRemovals)
      sweep.staticGrid.remove(sweep.staticGrid.findRow(id));
    for (const auto& [id, box] : sweep.pendingInserts) sweep.staticGrid.insert(box, id);
  } else {
    rebuildStaticGrid(sweep);
  }
  for (ProxyId id = 0; id < sweep.proxies.size(); ++id) {
    if (sweep.proxies[id].state != ProxyState::active) continue;
    const SignedBounds& maxBounds = sweep.proxies[id].window.maxBounds;
    const auto overlapsWindow = [&](const SignedBounds& minEndpoints) {
      return overlaps(minEndpoints, maxBounds);
    };
    if (edits > kSmallEditThreshold || std::any_of(edited.begin(), edited.end(), overlapsWindow))
      rebuildWindow(sweep, id);
  }
  sweep.staticCount += sweep.pendingInserts.size();
  ENFILADE_ASSERT(sweep.staticCount >= sweep.pendingRemovals.size());
  sweep.staticCount -= sweep.pendingRemovals.size();
  sweep.freeStaticIds.insert(sweep.freeStaticIds.end(), sweep.pendingRemovals.begin(),
                             sweep.pendingRemovals.end());
  sweep.pendingInserts.clear();
  sweep.pendingRemovals.clear();
}

}  // namespace enfilade::collision
