// Paths on the meshes of an agent: corridors are proposed, walked, repaired and refuted.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "scene/navigation/path_finder.hpp"
#include "scene/navigation/walk/grid_search.hpp"
#include "scene/navigation/walk/shorter_parts.hpp"

namespace enfilade::scene {

inline constexpr double kMaxMeshHeight =
    0.2;                                 ///< metres between a place and its mesh, also over stairs
inline constexpr double kSameFloor = 1;  ///< metres between the heights of a mesh and its floor

inline constexpr double kRepairMargin = 1.5;  ///< metres around the beginning of a repair

/// The work and the obstacles of a search so far.
struct Proof {
  explicit Proof(std::size_t maxRepairWalks);

  GridSearch coarse, fine;
  std::size_t quickWalks;  ///< that are left
  bool isQuick = false;    ///< only short repairs are tried: a failure refutes no portal
  double shortestLine = std::numeric_limits<double>::infinity();  ///< metres, of all proposals
  bool isRepaired = false;                                        ///< the present proposal
  Vec3 failedAt = Vec3::Zero();                                   ///< where the last proof failed
  std::vector<Obstruction> met;
  std::size_t improvementWalks;  ///< that are left for repairs on the fine grid after one was found
  std::size_t bendWalks;         ///< that are left for bends
  BumpSearch bumps;
  std::optional<Vec3> bump;  ///< the first one of the path that was proved last
};

/// Metres on each axis: how far a place may be off its mesh.
Vec3 computeMeshReach(const PathFinder& finder);

/// Whether a walk arrived, also in height: the height of its goal does not stop it.
bool isThere(const WalkOutcome& outcome, const Vec3& goal, double heightError);

/// Walks the whole path without a stop: after a step a place may be reached at another height.
bool walksOn(Walker& walker, const std::vector<Vec3>& points, Proof& proof);
/// As walksOn(). Then leads the path around low objects, where this shortens the path of the feet.
/// Sets the lengths, `proof.bump` and its climb.
bool walksWithoutBumps(Walker& walker, NavigationPath& path, Proof& proof);

/// Versions of a path that are proved: all, or up to the first that leads over no low object.
enum class Versions : std::uint8_t { all, untilLevel };

/// Proves versions of a path in turn. Returns the one on which the feet move least; none: no
/// version can be walked.
NavigationPath proveVersions(Walker& walker, std::span<const std::vector<Vec3>> versions,
                             Versions tried, Proof& proof);

/// Replaces bends of a proved path by shorter ways on grids of `spacing` metres, if the whole can
/// then be walked.
void tightenBends(Walker& walker, NavigationPath& path, double spacing, Proof& proof);

/// Metres along a short line on each mesh, with those to and from it.
MeshLines measureLines(const PathFinder& finder, const Vec3& from, const Vec3& to);

/// A path on the ample mesh, or on the scarce one; without a reason if none is found.
NavigationPath findPathByMeshes(const PathFinder& finder, const Vec3& start, const Vec3& goal,
                                Proof& proof);

}  // namespace enfilade::scene
