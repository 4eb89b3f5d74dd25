// The walkable polygons of a scene and the portals between them: proposes paths. A portal that a
// proof refuted is closed.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "scene/navigation/mesh/tile_mesh.hpp"

namespace enfilade::scene {

/// A polygon, and a point of it.
struct MeshPoint {
  std::uint32_t polygon = 0;
  Vec3 point = Vec3::Zero();  ///< scene frame, metres; its height is that of the polygon
};

/// A sequence of polygons; each has a portal to the next one.
struct Corridor {
  std::vector<std::uint32_t> polygons;
  double cost = 0;  ///< metres, through the middles of the portals
};

/// The opening from a polygon to a neighbour. From inside of the polygon, `low` to `high` turns
/// from +X towards +Z.
struct Portal {
  std::uint32_t to = 0;
  Vec3 low = Vec3::Zero();
  Vec3 high = Vec3::Zero();
  /// The end is on the boundary of the mesh: shortest lines bend at such places.
  bool lowIsOnBoundary = true;
  bool highIsOnBoundary = true;
  bool closed = false;
  std::uint8_t failures = 0;

  Vec3 middle() const { return 0.5 * (low + high); }
};

/// A part of the boundary of the mesh.
struct BoundaryEdge {
  std::uint32_t polygon = 0;
  Vec3 from = Vec3::Zero(), to = Vec3::Zero();  ///< scene frame, metres
  Vec3 outward = Vec3::Zero();                  ///< horizontal, unit
};

/// Square cells seen from above, in metres. Cell 0 has its corner at (x, z); rows run along x.
struct MapCells {
  double x = 0, z = 0, cell = 0;
  std::uint32_t width = 0, height = 0;
};

/// Copies share nothing. Const functions may be called from several threads.
class NavigationMesh {
 public:
  NavigationMesh(const TileGrid& grid, std::vector<TileMesh> tiles);
  ~NavigationMesh();
  NavigationMesh(NavigationMesh&&) noexcept;
  NavigationMesh& operator=(NavigationMesh&&) noexcept;

  std::size_t polygonCount() const { return centres_.size(); }
  double area() const;  ///< square metres, horizontal, of all polygons
  double polygonArea(std::uint32_t polygon) const { return areas_[polygon]; }
  const Vec3& centre(std::uint32_t polygon) const { return centres_[polygon]; }
  /// Three corners per triangle, with the heights of the floor within the polygon.
  std::vector<Vec3> makeTriangles(std::uint32_t polygon) const;
  bool isUnderSky(std::uint32_t polygon) const { return isUnderSky_[polygon]; }
  /// The point of a polygon that is closest to `point`.
  Vec3 closestPoint(std::uint32_t polygon, const Vec3& point) const;
  std::size_t memoryBytes() const { return bytes_; }

  /// The closest point of the mesh to `point` within `extent` metres on each axis.
  std::optional<MeshPoint> findNearest(const Vec3& point, const Vec3& extent) const;
  /// The polygons within `extent` metres of a point on each axis, in no order.
  std::vector<std::uint32_t> findPolygons(const Vec3& point, const Vec3& extent) const;
  std::span<const Portal> portals(std::uint32_t polygon) const {
    return std::span(portals_).subspan(firstPortal_[polygon],
                                       firstPortal_[polygon + 1] - firstPortal_[polygon]);
  }
  /// The edges of polygons without a neighbour.
  std::vector<BoundaryEdge> collectBoundary() const;
  /// The cheapest corridor through the middles of open portals; nullopt: not connected.
  std::optional<Corridor> findCorridor(const MeshPoint& from, const MeshPoint& to) const;
  /// The corners of the shortest line within a corridor, with both ends.
  std::vector<Vec3> straighten(const Corridor& corridor, const Vec3& from, const Vec3& to) const;
  /// The middle of the portal between two neighbours, scene frame, metres.
  Vec3 portalMiddle(std::uint32_t from, std::uint32_t to) const;
  /// Closes the portals between two polygons, in both directions.
  void closePortal(std::uint32_t from, std::uint32_t to);
  void openPortal(std::uint32_t from, std::uint32_t to);
  /// Counts a failure of the portals between two polygons. Returns their failures.
  int countFailure(std::uint32_t from, std::uint32_t to);
  /// Forgets the failures of the portals between two polygons: a proved path leads through them.
  void forgetFailures(std::uint32_t from, std::uint32_t to);
  /// A point of a polygon for two numbers of 0..1, uniform in area.
  Vec3 pointInPolygon(std::uint32_t polygon, double s, double t) const;
  /// Sets the cells to 1 whose middle lies over a polygon from `lowest` to `highest`. If only a
  /// part of it may, `measureFloor` returns the height below or above a point of it; `top` is its
  /// highest.
  void rasterize(std::uint32_t polygon, const MapCells& grid, double lowest, double highest,
                 const std::function<double(const Vec3& onMesh, double top)>& measureFloor,
                 std::vector<std::uint8_t>& cells) const;
  /// For each polygon the number of its island: polygons joined by open portals. The largest island
  /// has number 0.
  std::vector<std::uint32_t> findIslands() const;

 private:
  struct Detour;
  void collectPortals();
  void markBoundary(const TileGrid& grid);
  void addBoundary(std::uint32_t polygon, const Portal& closed);
  std::vector<Portal*> findPortals(std::uint32_t a, std::uint32_t b);
  /// The vertex of a polygon above or below a point, within `distance` metres, or the point. Detour
  /// stores the ends of portals between tiles in 255ths of an edge.
  Vec3 snapToVertex(std::uint32_t reference, const Vec3& point, double distance) const;
  std::uint32_t getPolygonIndex(std::uint32_t reference) const;

  std::unique_ptr<Detour> detour_;
  std::vector<std::uint32_t> firstPolygonOfTile_;  ///< by index of the tile in Detour
  std::vector<std::uint32_t> references_;          ///< Detour's, by polygon
  std::vector<Vec3> centres_;
  std::vector<double> areas_;
  std::vector<bool> isUnderSky_;
  std::vector<std::uint32_t> firstPortal_;  ///< by polygon, and the end
  std::vector<Portal> portals_;
  std::size_t bytes_ = 0;
};

}  // namespace enfilade::scene
