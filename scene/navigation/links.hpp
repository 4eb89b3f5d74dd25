// PathLink: a drop from an edge or a lift ride. Links connect polygons that no walk over a mesh
// connects. The walker proves each link before it is used.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "scene/navigation/mesh/navigation_mesh.hpp"
#include "scene/navigation/walk/walker.hpp"

namespace enfilade::scene {

/// Means that a path may use in addition to floors, steps and stairs.
struct PathOptions {
  double maxDrop = 0;  ///< metres that it may fall at once; no more than a step: not at all
  bool lifts = false;  ///< it may call lifts and ride
  bool operator==(const PathOptions&) const = default;
};

struct PathLink {
  enum class Kind : std::uint8_t { drop, lift };
  Kind kind = Kind::drop;
  /// Feet, scene frame, metres. A drop: the last place before the edge, the landing. A lift: before
  /// it, in it at both stops, behind it.
  std::vector<Vec3> points;
  std::uint32_t to = 0;    ///< polygon of the last point
  double length = 0;       ///< metres that the agent walks
  double seconds = 0;      ///< without the time until the lift has come
  std::uint32_t body = 0;  ///< lift: index into Model::bodies
  std::uint32_t fromStop = 0, toStop = 0;
};

/// The links of an agent from the polygons of a mesh. Drops are proved when their polygon is first
/// asked for.
class Links {
 public:
  /// Moves lifts from stop to stop, and back. `mesh` and `world` must outlive the links.
  Links(WorldData& world, const NavigationAgent& agent, const NavigationMesh& mesh,
        const PathOptions& options);

  const PathOptions& options() const { return options_; }
  std::size_t memoryBytes() const { return bytes_; }
  const std::vector<PathLink>& from(std::uint32_t polygon, Walker& walker);

 private:
  /// A place at the edge of a mesh below which another floor lies.
  struct Edge {
    Vec3 place = Vec3::Zero();
    Vec3 outward = Vec3::Zero();  ///< horizontal, unit
  };
  void collectEdges();
  void collectLifts(WorldData& world);
  std::optional<PathLink> proveDrop(const Edge& edge, Walker& walker) const;
  std::optional<std::uint32_t> findPolygon(const Vec3& place) const;

  const WorldSettings& settings_;
  const NavigationAgent agent_;
  const NavigationMesh& mesh_;
  const PathOptions options_;
  std::map<std::uint32_t, std::vector<Edge>> edges_;      ///< not yet proved, by polygon
  std::map<std::uint32_t, std::vector<PathLink>> links_;  ///< by polygon of the first point
  std::size_t bytes_ = 0;                                 ///< with all drops that may be proved
};

}  // namespace enfilade::scene
