#include "scene/navigation/passages.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "scene/world/avatars/walk_velocity.hpp"

namespace enfilade::scene {
namespace {

constexpr double kSampleSpacing = 0.25;  // metres along the rim
constexpr double kMinFacing = 0.5;       // cosine of the angle between a gap and the rim's outside
constexpr double kClusterSize = 0.5;     // metres: of gaps whose middles are closer one is kept
constexpr double kNone = std::numeric_limits<double>::infinity();

}  // namespace

double computeLength(const std::vector<Vec3>& points) {
  double length = 0;
  for (std::size_t i = 1; i < points.size(); ++i) length += (points[i] - points[i - 1]).norm();
  return length;
}

std::span<const Passage> PassageList::passagesFrom(std::uint32_t polygon) const {
  const auto first = std::ranges::lower_bound(passages, polygon, {}, &Passage::fromPolygon);
  const auto last = std::ranges::upper_bound(passages, polygon, {}, &Passage::fromPolygon);
  return {first, last};
}

PassageList listParts(const NavigationMesh& mesh) {
  PassageList list{mesh.findIslands(), {}, {}};
  for (std::uint32_t polygon = 0; polygon < mesh.polygonCount(); ++polygon) {
    const std::uint32_t part = list.partOf[polygon];
    if (part >= list.areas.size()) list.areas.resize(part + 1);
    list.areas[part] += mesh.polygonArea(polygon);
  }
  return list;
}

void forEachRimPlace(const NavigationMesh& mesh, double spacing,
                     const std::function<void(const BoundaryEdge&, const Vec3&)>& visit) {
  for (const BoundaryEdge& edge : mesh.collectBoundary()) {
    const Vec3 along = edge.to - edge.from;
    const int count = std::max(1, static_cast<int>(std::ceil(along.norm() / spacing)));
    for (int i = 0; i < count; ++i) visit(edge, edge.from + (i + 0.5) / count * along);
  }
}

std::vector<RimGap> findRimGaps(const NavigationMesh& mesh,
                                const std::vector<std::uint32_t>& partOf, double reach,
                                double heightReach) {
  struct Candidate {
    double length = 0;
    RimGap gap;
  };
  using Cluster = std::array<std::int64_t, 5>;
  std::map<Cluster, Candidate> clusters;
  const auto add = [&](const RimGap& gap, double length) {
    const auto [low, high] = std::minmax(partOf[gap.fromPolygon], partOf[gap.toPolygon]);
    Cluster key{low, high};
    for (int axis = 0; axis < 3; ++axis)
      key[static_cast<std::size_t>(axis) + 2] =
          std::llround(0.5 * (gap.from[axis] + gap.to[axis]) / kClusterSize);
    const auto [known, isNew] = clusters.try_emplace(key, Candidate{length, gap});
    if (!isNew && length < known->second.length) known->second = {length, gap};
  };
  const auto addGapsAt = [&](const BoundaryEdge& edge, const Vec3& from) {
    std::map<std::uint32_t, Candidate> nearest;  // by part
    for (const std::uint32_t other : mesh.findPolygons(from, {reach, heightReach, reach})) {
      if (partOf[other] == partOf[edge.polygon]) continue;
      const RimGap gap{edge.polygon, other, from, mesh.closestPoint(other, from)};
      const Vec3 across = projectToGround(gap.to - from);
      const double length = across.norm();
      if (length > reach || !(length > 0) || std::abs(gap.to.y() - from.y()) > heightReach ||
          across.dot(edge.outward) < kMinFacing * length)
        continue;
      const auto [known, isNew] = nearest.try_emplace(partOf[other], Candidate{length, gap});
      if (!isNew && length < known->second.length) known->second = {length, gap};
    }
    for (const auto& [part, one] : nearest) add(one.gap, one.length);
  };
  forEachRimPlace(mesh, kSampleSpacing, addGapsAt);
  std::vector<Candidate> candidates;
  for (const auto& [key, candidate] : clusters) candidates.push_back(candidate);
  std::ranges::stable_sort(candidates, {}, &Candidate::length);
  std::vector<RimGap> gaps;
  for (const Candidate& one : candidates) gaps.push_back(one.gap);
  return gaps;
}

PassageRoute findPassageRoute(const PassageList& list, const MeshPoint& from, const MeshPoint& to,
                              const std::vector<bool>& excluded) {
  const std::vector<Passage>& passages = list.passages;
  const auto getPart = [&](std::uint32_t polygon) { return list.partOf[polygon]; };
  struct Node {
    double length = kNone;  // of the way to the end of the passage
    std::size_t parent = 0;
    bool isDone = false;
  };
  std::vector<Node> nodes(passages.size());
  const std::size_t none = passages.size();
  const auto reach = [&](std::uint32_t part, const Vec3& point, double length, std::size_t parent) {
    for (std::size_t i = 0; i < passages.size(); ++i) {
      if (excluded[i] || nodes[i].isDone || getPart(passages[i].fromPolygon) != part) continue;
      const double next = length + (passages[i].points.front() - point).norm() + passages[i].length;
      if (next < nodes[i].length) nodes[i] = {next, parent, false};
    }
  };
  reach(getPart(from.polygon), from.point, 0, none);
  PassageRoute best{{}, kNone};
  for (;;) {
    std::size_t at = none;
    for (std::size_t i = 0; i < nodes.size(); ++i)
      if (!nodes[i].isDone && nodes[i].length < (at == none ? kNone : nodes[at].length)) at = i;
    if (at == none || nodes[at].length >= best.length) break;
    nodes[at].isDone = true;
    const Vec3& end = passages[at].points.back();
    if (getPart(passages[at].toPolygon) == getPart(to.polygon)) {
      const double length = nodes[at].length + (to.point - end).norm();
      if (length < best.length) {
        best = {{}, length};
        for (std::size_t i = at; i != none; i = nodes[i].parent) best.passages.push_back(i);
      }
    }
    reach(getPart(passages[at].toPolygon), end, nodes[at].length, at);
  }
  std::ranges::reverse(best.passages);
  if (best.passages.empty()) best.length = 0;
  return best;
}

}  // namespace enfilade::scene
