// Off-mesh connections: walked paths between two places of a navigation mesh. A mesh keeps some
// centimetres more than an agent needs, so it ends before a gap that the agent just passes.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <span>
#include <vector>

#include "scene/navigation/mesh/navigation_mesh.hpp"

namespace enfilade::scene {

/// Metres, in space.
double computeLength(const std::vector<Vec3>& points);

/// A path in one direction that an agent walked.
struct OffMeshConnection {
  std::uint32_t fromPolygon = 0, toPolygon = 0;
  std::vector<Vec3> points;  ///< feet, scene frame, metres
  double length = 0;         ///< metres
};

inline constexpr double kMaxSmallArea = 1;  ///< square metres, of a part of a mesh

/// The off-mesh connections of a mesh.
struct ConnectionList {
  std::vector<std::uint32_t> partOf;  ///< by polygon: part of the mesh that open portals join
  std::vector<double> areas;          ///< by part, square metres; 0: no place to stand was found
  std::vector<OffMeshConnection> connections;  ///< ascending by fromPolygon

  std::size_t memoryBytes() const;
  bool isSmallPart(std::uint32_t polygon) const { return areas[partOf[polygon]] <= kMaxSmallArea; }
  std::span<const OffMeshConnection> findConnectionsFrom(std::uint32_t polygon) const;
};

/// The parts of a mesh, without connections.
ConnectionList listParts(const NavigationMesh& mesh);

/// Calls `visit` for places along the boundary of a mesh, at most `spacing` metres apart.
void forEachBoundaryPlace(const NavigationMesh& mesh, double spacing,
                          const std::function<void(const BoundaryEdge&, const Vec3&)>& visit);

/// Two places of the boundary of a mesh that face each other, on different parts.
struct BoundaryGap {
  std::uint32_t fromPolygon = 0, toPolygon = 0;
  Vec3 from = Vec3::Zero(), to = Vec3::Zero();  ///< scene frame, metres
};

struct MeasuredGap {
  double length = std::numeric_limits<double>::infinity();  ///< metres
  BoundaryGap gap = {};
};

/// The gaps of a map, the shortest first; equal ones in the order of their keys.
template <class Key>
std::vector<BoundaryGap> listByLength(const std::map<Key, MeasuredGap>& gaps) {
  std::vector<MeasuredGap> sorted;
  for (const auto& [key, measured] : gaps) sorted.push_back(measured);
  std::ranges::stable_sort(sorted, {}, &MeasuredGap::length);
  std::vector<BoundaryGap> listed;
  for (const MeasuredGap& measured : sorted) listed.push_back(measured.gap);
  return listed;
}

/// Gaps up to `reach` metres, horizontally, across which an agent may pass: the shortest first.
std::vector<BoundaryGap> findBoundaryGaps(const NavigationMesh& mesh,
                                          const std::vector<std::uint32_t>& partOf, double reach,
                                          double heightReach);

/// The connections of the shortest route that leads through some, in order; empty: none.
struct ConnectionRoute {
  std::vector<std::size_t> connections;
  double length = 0;  ///< metres, at most that of the path
};
/// `excluded`: by index of a connection. The path within a part counts as a straight line.
ConnectionRoute findConnectionRoute(const ConnectionList& list, const MeshPoint& from,
                                    const MeshPoint& to, const std::vector<bool>& excluded);

}  // namespace enfilade::scene
