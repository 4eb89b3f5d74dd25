#include "scene/navigation/mesh/off_mesh_connections.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "scene/world/avatars/walk_velocity.hpp"

namespace enfilade::scene {
namespace {

constexpr double kSampleSpacing = 0.25;  // metres along the boundary
constexpr double kMinFacing = 0.5;  // cosine of the angle between a gap and the boundary's outside
constexpr double kClusterSize = 0.5;  // metres: of gaps whose middles are closer one is kept
constexpr double kNone = std::numeric_limits<double>::infinity();

}  // namespace

double computeLength(const std::vector<Vec3>& points) {
  double length = 0;
  for (std::size_t i = 1; i < points.size(); ++i) length += (points[i] - points[i - 1]).norm();
  return length;
}

std::span<const OffMeshConnection> ConnectionList::findConnectionsFrom(
    std::uint32_t polygon) const {
  const auto first =
      std::ranges::lower_bound(connections, polygon, {}, &OffMeshConnection::fromPolygon);
  const auto last =
      std::ranges::upper_bound(connections, polygon, {}, &OffMeshConnection::fromPolygon);
  return {first, last};
}

std::size_t ConnectionList::memoryBytes() const {
  std::size_t bytes = partOf.size() * sizeof(partOf[0]) + areas.size() * sizeof(areas[0]) +
                      connections.size() * sizeof(OffMeshConnection);
  for (const OffMeshConnection& one : connections) bytes += one.points.size() * sizeof(Vec3);
  return bytes;
}

ConnectionList listParts(const NavigationMesh& mesh) {
  ConnectionList list{mesh.findIslands(), {}, {}};
  for (std::uint32_t polygon = 0; polygon < mesh.polygonCount(); ++polygon) {
    const std::uint32_t part = list.partOf[polygon];
    if (part >= list.areas.size()) list.areas.resize(part + 1);
    list.areas[part] += mesh.polygonArea(polygon);
  }
  return list;
}

void forEachBoundaryPlace(const NavigationMesh& mesh, double spacing,
                          const std::function<void(const BoundaryEdge&, const Vec3&)>& visit) {
  for (const BoundaryEdge& edge : mesh.collectBoundary()) {
    const Vec3 along = edge.to - edge.from;
    const int count = std::max(1, static_cast<int>(std::ceil(along.norm() / spacing)));
    for (int i = 0; i < count; ++i) visit(edge, edge.from + (i + 0.5) / count * along);
  }
}

std::vector<BoundaryGap> findBoundaryGaps(const NavigationMesh& mesh,
                                          const std::vector<std::uint32_t>& partOf, double reach,
                                          double heightReach) {
  using Cluster = std::array<std::int64_t, 5>;
  std::map<Cluster, MeasuredGap> clusters;
  const auto add = [&](const BoundaryGap& gap, double length) {
    const auto [low, high] = std::minmax(partOf[gap.fromPolygon], partOf[gap.toPolygon]);
    Cluster key{low, high};
    for (int axis = 0; axis < 3; ++axis)
      key[static_cast<std::size_t>(axis) + 2] =
          std::llround(0.5 * (gap.from[axis] + gap.to[axis]) / kClusterSize);
    const auto [known, isNew] = clusters.try_emplace(key, MeasuredGap{length, gap});
    if (!isNew && length < known->second.length) known->second = {length, gap};
  };
  const auto addGapsAt = [&](const BoundaryEdge& edge, const Vec3& from) {
    std::map<std::uint32_t, MeasuredGap> nearest;  // by part
    for (const std::uint32_t other : mesh.findPolygons(from, {reach, heightReach, reach})) {
      if (partOf[other] == partOf[edge.polygon]) continue;
      const BoundaryGap gap{edge.polygon, other, from, mesh.closestPoint(other, from)};
      const Vec3 across = projectToGround(gap.to - from);
      const double length = across.norm();
      if (length > reach || !(length > 0) || std::abs(gap.to.y() - from.y()) > heightReach ||
          across.dot(edge.outward) < kMinFacing * length)
        continue;
      const auto [known, isNew] = nearest.try_emplace(partOf[other], MeasuredGap{length, gap});
      if (!isNew && length < known->second.length) known->second = {length, gap};
    }
    for (const auto& [part, one] : nearest) add(one.gap, one.length);
  };
  forEachBoundaryPlace(mesh, kSampleSpacing, addGapsAt);
  return listByLength(clusters);
}

ConnectionRoute findConnectionRoute(const ConnectionList& list, const MeshPoint& from,
                                    const MeshPoint& to, const std::vector<bool>& excluded) {
  const std::vector<OffMeshConnection>& connections = list.connections;
  const auto getPart = [&](std::uint32_t polygon) { return list.partOf[polygon]; };
  struct Node {
    double length = kNone;  // of the route to the end of the connection
    std::size_t parent = 0;
    bool isDone = false;
  };
  std::vector<Node> nodes(connections.size());
  const std::size_t none = connections.size();
  const auto reach = [&](std::uint32_t part, const Vec3& point, double length, std::size_t parent) {
    for (std::size_t i = 0; i < connections.size(); ++i) {
      if (excluded[i] || nodes[i].isDone || getPart(connections[i].fromPolygon) != part) continue;
      const double next =
          length + (connections[i].points.front() - point).norm() + connections[i].length;
      if (next < nodes[i].length) nodes[i] = {next, parent, false};
    }
  };
  reach(getPart(from.polygon), from.point, 0, none);
  ConnectionRoute best{{}, kNone};
  for (;;) {
    std::size_t at = none;
    for (std::size_t i = 0; i < nodes.size(); ++i)
      if (!nodes[i].isDone && nodes[i].length < (at == none ? kNone : nodes[at].length)) at = i;
    if (at == none || nodes[at].length >= best.length) break;
    nodes[at].isDone = true;
    const Vec3& end = connections[at].points.back();
    if (getPart(connections[at].toPolygon) == getPart(to.polygon)) {
      const double length = nodes[at].length + (to.point - end).norm();
      if (length < best.length) {
        best = {{}, length};
        for (std::size_t i = at; i != none; i = nodes[i].parent) best.connections.push_back(i);
      }
    }
    reach(getPart(connections[at].toPolygon), end, nodes[at].length, at);
  }
  std::ranges::reverse(best.connections);
  if (best.connections.empty()) best.length = 0;
  return best;
}

}  // namespace enfilade::scene
