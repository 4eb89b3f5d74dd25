// Ways off a navigation mesh, from one place of it to another. A mesh keeps some centimetres more
// than an agent needs, so it ends before a gap that the agent just passes.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "scene/navigation/mesh/navigation_mesh.hpp"

namespace enfilade::scene {

/// Metres, in space.
double computeLength(const std::vector<Vec3>& points);

/// A way in one direction that an agent walked.
struct Passage {
  std::uint32_t fromPolygon = 0, toPolygon = 0;
  std::vector<Vec3> points;  ///< feet, scene frame, metres
  double length = 0;         ///< metres
};

inline constexpr double kMaxSmallArea = 1;  ///< square metres, of a part of a mesh

/// The passages of a mesh.
struct PassageList {
  std::vector<std::uint32_t> partOf;  ///< by polygon: part of the mesh that open portals join
  std::vector<double> areas;          ///< by part, square metres; 0: no place to stand was found
  std::vector<Passage> passages;      ///< ascending by fromPolygon

  bool isSmallPart(std::uint32_t polygon) const { return areas[partOf[polygon]] <= kMaxSmallArea; }
  std::span<const Passage> passagesFrom(std::uint32_t polygon) const;
};

/// The parts of a mesh, without passages.
PassageList listParts(const NavigationMesh& mesh);

/// Calls `visit` for places along the rim of a mesh, at most `spacing` metres apart.
void forEachRimPlace(const NavigationMesh& mesh, double spacing,
                     const std::function<void(const BoundaryEdge&, const Vec3&)>& visit);

/// Two places of the rim of a mesh that face each other, on different parts.
struct RimGap {
  std::uint32_t fromPolygon = 0, toPolygon = 0;
  Vec3 from = Vec3::Zero(), to = Vec3::Zero();  ///< scene frame, metres
};

/// Gaps up to `reach` metres, horizontally, across which an agent may pass: the shortest first.
std::vector<RimGap> findRimGaps(const NavigationMesh& mesh,
                                const std::vector<std::uint32_t>& partOf, double reach,
                                double heightReach);

/// The passages of the shortest way that leads through some, in order; empty: none.
struct PassageRoute {
  std::vector<std::size_t> passages;
  double length = 0;  ///< metres, at most that of the way
};
/// `excluded`: by index of a passage. The way within a part counts as a straight line.
PassageRoute findPassageRoute(const PassageList& list, const MeshPoint& from, const MeshPoint& to,
                              const std::vector<bool>& excluded);

}  // namespace enfilade::scene
