#include "scene/navigation/mesh/navigation_mesh.hpp"

#include <DetourAlloc.h>
#include <DetourCommon.h>
#include <DetourNavMesh.h>
#include <DetourNavMeshQuery.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>
#include <queue>
#include <stdexcept>
#include <string>
#include <unordered_set>

namespace enfilade::scene {
namespace {

constexpr int kReferenceBits = 22;               // of a tile and a polygon, in a 32-bit dtPolyRef
constexpr std::size_t kFirstPolygonCount = 256;  // a query with more is repeated
constexpr int kMaxCorners = 4096;
constexpr int kWhole = 255;       // of an edge: Detour stores the ends of its parts in 255ths
constexpr int kRoundedParts = 3;  // that many may be missing

using Float3 = std::array<float, 3>;

Float3 toFloats(const Vec3& v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

Vec3 toVec3(const float* v) {
  return {v[0], v[1], v[2]};
}

int countBits(std::size_t values) {
  int bits = 0;
  while ((std::size_t{1} << bits) < values) ++bits;
  return bits;
}

}  // namespace

struct NavigationMesh::Detour {
  dtNavMesh mesh;
  dtNavMeshQuery query;  ///< its functions used here keep no state, except for the node pool
  dtQueryFilter filter;

  const dtMeshTile& tile(std::uint32_t reference, const dtPoly** polygon) const {
    const dtMeshTile* found = nullptr;
    mesh.getTileAndPolyByRefUnsafe(reference, &found, polygon);
    return *found;
  }
};

NavigationMesh::NavigationMesh(const TileGrid& grid, std::vector<TileMesh> tiles)
    : detour_(std::make_unique<Detour>()) {
  dtNavMeshParams params{};
  const Float3 origin = toFloats(grid.origin);
  std::copy(origin.begin(), origin.end(), params.orig);
  params.tileWidth = params.tileHeight = static_cast<float>(grid.tileSize());
  std::erase_if(tiles, [](const auto& tile) { return tile.empty(); });
  const int tileBits = countBits(std::max<std::size_t>(2, tiles.size()));
  params.maxTiles = 1 << tileBits;
  params.maxPolys = 1 << (kReferenceBits - tileBits);
  if (tileBits > 14 || dtStatusFailed(detour_->mesh.init(&params)))
    throw std::runtime_error("navigation: the scene has too many tiles (" +
                             std::to_string(tiles.size()) + ")");
  for (const TileMesh& tile : tiles) {
    auto* data = static_cast<unsigned char*>(dtAlloc(tile.size(), DT_ALLOC_PERM));
    if (!data) throw std::bad_alloc();
    std::memcpy(data, tile.data(), tile.size());
    bytes_ += tile.size();
    if (dtStatusFailed(detour_->mesh.addTile(data, static_cast<int>(tile.size()), DT_TILE_FREE_DATA,
                                             0, nullptr))) {
      dtFree(data);
      throw std::runtime_error("navigation: a tile has too many polygons");
    }
  }
  if (dtStatusFailed(detour_->query.init(&detour_->mesh, 64)))
    throw std::runtime_error("navigation: Detour cannot start");
  collectPortals();
  markBoundary(grid);
}

NavigationMesh::~NavigationMesh() = default;
NavigationMesh::NavigationMesh(NavigationMesh&&) noexcept = default;
NavigationMesh& NavigationMesh::operator=(NavigationMesh&&) noexcept = default;

void NavigationMesh::collectPortals() {
  const dtNavMesh& mesh = detour_->mesh;
  for (int i = 0; i < mesh.getMaxTiles(); ++i) {
    const dtMeshTile* tile = mesh.getTile(i);
    firstPolygonOfTile_.push_back(static_cast<std::uint32_t>(references_.size()));
    if (!tile->header) continue;
    const dtPolyRef base = mesh.getPolyRefBase(tile);
    for (int p = 0; p < tile->header->polyCount; ++p) {
      const dtPoly& polygon = tile->polys[p];
      references_.push_back(base | static_cast<dtPolyRef>(p));
      Float3 centre{};
      dtCalcPolyCenter(centre.data(), polygon.verts, polygon.vertCount, tile->verts);
      const auto index = static_cast<std::uint32_t>(references_.size()) - 1;
      centres_.push_back(closestPoint(index, toVec3(centre.data())));
      double twice = 0;
      const auto corner = [&](int k) { return toVec3(&tile->verts[polygon.verts[k] * 3]); };
      for (int k = 2; k < polygon.vertCount; ++k) {
        const Vec3 a = corner(k - 1) - corner(0), b = corner(k) - corner(0);
        twice += std::abs(a.x() * b.z() - a.z() * b.x());
      }
      areas_.push_back(0.5 * twice);
      isUnderSky_.push_back((polygon.flags & kUnderSkyFlag) != 0);
    }
  }
  for (const dtPolyRef reference : references_) {
    firstPortal_.push_back(static_cast<std::uint32_t>(portals_.size()));
    const dtPoly* polygon = nullptr;
    const dtMeshTile& tile = detour_->tile(reference, &polygon);
    for (unsigned link = polygon->firstLink; link != DT_NULL_LINK; link = tile.links[link].next) {
      const dtLink& to = tile.links[link];
      if (to.ref == 0) continue;
      Vec3 a = toVec3(&tile.verts[polygon->verts[to.edge] * 3]);
      Vec3 b = toVec3(&tile.verts[polygon->verts[(to.edge + 1) % polygon->vertCount] * 3]);
      if (to.side != 0xff) {  // a portal to another tile may be a part of the edge
        const double low = to.bmin / 255.0, high = to.bmax / 255.0;
        const Vec3 start = a, edge = b - a;
        a = snapToVertex(to.ref, start + low * edge, edge.norm() / 255);
        b = snapToVertex(to.ref, start + high * edge, edge.norm() / 255);
      }
      const Vec3 &inside = centres_[getPolygonIndex(reference)], toA = a - inside, toB = b - inside;
      if (toA.x() * toB.z() < toA.z() * toB.x()) std::swap(a, b);
      portals_.push_back({.to = getPolygonIndex(to.ref), .low = a, .high = b});
    }
  }
  firstPortal_.push_back(static_cast<std::uint32_t>(portals_.size()));
  bytes_ += portals_.size() * sizeof(Portal) + centres_.size() * (sizeof(Vec3) + 16);
}

/// Decides which ends of portals are on the boundary. Vertices lie on the cells of the grid.
void NavigationMesh::markBoundary(const TileGrid& grid) {
  const auto computeKey = [&](const Vec3& point) {
    const auto x =
        static_cast<std::uint32_t>(std::lround((point.x() - grid.origin.x()) / grid.cell));
    const auto z =
        static_cast<std::uint32_t>(std::lround((point.z() - grid.origin.z()) / grid.cell));
    return std::uint64_t{x} << 32 | z;
  };
  std::unordered_set<std::uint64_t> boundary;
  for (std::uint32_t index = 0; index < polygonCount(); ++index) {
    const dtPoly* polygon = nullptr;
    const dtMeshTile& tile = detour_->tile(references_[index], &polygon);
    // 255ths of an edge that portals cover. Those of one edge are of one floor: they do not
    // overlap.
    std::array<int, DT_VERTS_PER_POLYGON> covered{};
    for (unsigned link = polygon->firstLink; link != DT_NULL_LINK; link = tile.links[link].next) {
      const dtLink& to = tile.links[link];
      covered[to.edge] += to.side == 0xff ? kWhole : to.bmax - to.bmin;
    }
    for (std::size_t k = 0; k < polygon->vertCount; ++k) {
      if (covered[k] >= kWhole - kRoundedParts) continue;
      for (const std::size_t end : {k, (k + 1) % polygon->vertCount})
        boundary.insert(computeKey(toVec3(&tile.verts[polygon->verts[end] * 3])));
      // A part of the edge has no neighbour: the portals of the others may end anywhere on it.
      if (covered[k] > 0)
        for (std::uint32_t p = firstPortal_[index]; p < firstPortal_[index + 1]; ++p)
          for (const Vec3& end : {portals_[p].low, portals_[p].high})
            boundary.insert(computeKey(end));
    }
  }
  for (Portal& portal : portals_) {
    portal.lowIsOnBoundary = boundary.contains(computeKey(portal.low));
    portal.highIsOnBoundary = boundary.contains(computeKey(portal.high));
  }
}

Vec3 NavigationMesh::snapToVertex(std::uint32_t reference, const Vec3& point,
                                  double distance) const {
  const dtPoly* polygon = nullptr;
  const dtMeshTile& tile = detour_->tile(reference, &polygon);
  for (int k = 0; k < polygon->vertCount; ++k) {
    const Vec3 vertex = toVec3(&tile.verts[polygon->verts[k] * 3]);
    if (std::hypot(vertex.x() - point.x(), vertex.z() - point.z()) <= distance)
      return {vertex.x(), point.y(), vertex.z()};
  }
  return point;
}

std::uint32_t NavigationMesh::getPolygonIndex(std::uint32_t reference) const {
  unsigned salt = 0, tile = 0, polygon = 0;
  detour_->mesh.decodePolyId(reference, salt, tile, polygon);
  return firstPolygonOfTile_[tile] + polygon;
}

std::vector<BoundaryEdge> NavigationMesh::collectBoundary() const {
  std::vector<BoundaryEdge> edges;
  for (std::uint32_t index = 0; index < polygonCount(); ++index) {
    const dtPoly* polygon = nullptr;
    const dtMeshTile& tile = detour_->tile(references_[index], &polygon);
    for (int k = 0; k < polygon->vertCount; ++k) {
      if (polygon->neis[k] != 0) continue;
      const Vec3 from = toVec3(&tile.verts[polygon->verts[k] * 3]);
      const Vec3 to = toVec3(&tile.verts[polygon->verts[(k + 1) % polygon->vertCount] * 3]);
      Vec3 outward(to.z() - from.z(), 0, from.x() - to.x());
      const double length = outward.norm();
      if (!(length > 0)) continue;
      outward /= length;
      if (outward.dot(centres_[index] - from) > 0) outward = -outward;
      edges.push_back({index, from, to, outward});
    }
  }
  return edges;
}

double NavigationMesh::area() const {
  return std::accumulate(areas_.begin(), areas_.end(), 0.0);
}

std::vector<std::uint32_t> NavigationMesh::findPolygons(const Vec3& point,
                                                        const Vec3& extent) const {
  const Float3 centre = toFloats(point), half = toFloats(extent);
  thread_local std::vector<dtPolyRef> found(kFirstPolygonCount);
  int count = 0;
  for (;;) {
    detour_->query.queryPolygons(centre.data(), half.data(), &detour_->filter, found.data(), &count,
                                 static_cast<int>(found.size()));
    if (static_cast<std::size_t>(count) < found.size() || found.size() > polygonCount()) break;
    found.resize(2 * found.size());
  }
  std::vector<std::uint32_t> polygons;
  for (int i = 0; i < count; ++i)
    polygons.push_back(getPolygonIndex(found[static_cast<std::size_t>(i)]));
  return polygons;
}

Vec3 NavigationMesh::closestPoint(std::uint32_t polygon, const Vec3& point) const {
  const Float3 to = toFloats(point);
  Float3 closest{};
  bool isOver = false;
  detour_->query.closestPointOnPoly(references_[polygon], to.data(), closest.data(), &isOver);
  return toVec3(closest.data());
}

std::optional<MeshPoint> NavigationMesh::findNearest(const Vec3& point, const Vec3& extent) const {
  std::optional<MeshPoint> best;
  double minDistance = std::numeric_limits<double>::infinity();
  for (const std::uint32_t polygon : findPolygons(point, extent)) {
    const Vec3 candidate = closestPoint(polygon, point), aside = candidate - point;
    const double distance = aside.squaredNorm();
    // Of a slanted polygon, the box may be near alone.
    if (!(distance < minDistance) || (aside.array().abs() > extent.array()).any()) continue;
    minDistance = distance;
    best = MeshPoint{polygon, candidate};
  }
  return best;
}

std::optional<Corridor> NavigationMesh::findCorridor(const MeshPoint& from,
                                                     const MeshPoint& to) const {
  struct Node {
    double cost = std::numeric_limits<double>::infinity();
    std::uint32_t parent = 0;
    Vec3 point = Vec3::Zero();
    std::uint32_t search = 0;  ///< the search that wrote this node
    bool done = false;
  };
  thread_local std::vector<Node> nodes;
  thread_local std::uint32_t search = 0;
  ++search;
  if (nodes.size() < polygonCount()) nodes.resize(polygonCount());
  const auto node = [&](std::uint32_t polygon) -> Node& {
    Node& one = nodes[polygon];
    if (one.search != search) one = {.search = search};
    return one;
  };
  using Entry = std::pair<double, std::uint32_t>;  // estimate of the whole cost, polygon
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  node(from.polygon).cost = 0;
  node(from.polygon).point = from.point;
  open.push({0, from.polygon});
  while (!open.empty()) {
    const std::uint32_t current = open.top().second;
    open.pop();
    Node& here = node(current);
    if (here.done) continue;
    here.done = true;
    if (current == to.polygon) break;
    for (std::uint32_t p = firstPortal_[current]; p < firstPortal_[current + 1]; ++p) {
      const Portal& portal = portals_[p];
      if (portal.closed) continue;
      const Vec3 point = portal.to == to.polygon ? to.point : portal.middle();
      const double through = portal.to == to.polygon ? (portal.middle() - here.point).norm() +
                                                           (to.point - portal.middle()).norm()
                                                     : (point - here.point).norm();
      Node& next = node(portal.to);
      if (next.done || !(here.cost + through < next.cost)) continue;
      next.cost = here.cost + through;
      next.parent = current;
      next.point = point;
      open.push({next.cost + (to.point - point).norm(), portal.to});
    }
  }
  if (!node(to.polygon).done) return std::nullopt;
  Corridor corridor;
  corridor.cost =
      from.polygon == to.polygon ? (to.point - from.point).norm() : node(to.polygon).cost;
  for (std::uint32_t polygon = to.polygon; polygon != from.polygon; polygon = node(polygon).parent)
    corridor.polygons.push_back(polygon);
  corridor.polygons.push_back(from.polygon);
  std::reverse(corridor.polygons.begin(), corridor.polygons.end());
  return corridor;
}

std::vector<Vec3> NavigationMesh::straighten(const Corridor& corridor, const Vec3& from,
                                             const Vec3& to) const {
  std::vector<dtPolyRef> path;
  for (const std::uint32_t polygon : corridor.polygons) path.push_back(references_[polygon]);
  const Float3 start = toFloats(from), end = toFloats(to);
  std::vector<float> corners(3 * kMaxCorners);
  int count = 0;
  detour_->query.findStraightPath(start.data(), end.data(), path.data(),
                                  static_cast<int>(path.size()), corners.data(), nullptr, nullptr,
                                  &count, kMaxCorners);
  std::vector<Vec3> points;
  for (int i = 0; i < count; ++i)
    points.push_back(toVec3(&corners[static_cast<std::size_t>(3 * i)]));
  return points;
}

Vec3 NavigationMesh::portalMiddle(std::uint32_t from, std::uint32_t to) const {
  for (std::uint32_t p = firstPortal_[from]; p < firstPortal_[from + 1]; ++p)
    if (portals_[p].to == to) return portals_[p].middle();
  return centres_[from];
}

/// Shortest lines may bend at the ends of a closed portal of `polygon`: marks them in all polygons
/// around. They stay marked when it opens again: this costs time, but no line.
void NavigationMesh::addBoundary(std::uint32_t polygon, const Portal& closed) {
  constexpr double kSame = 1e-3;  // metres
  for (const Vec3& end : {closed.low, closed.high}) {
    const auto isEnd = [&](const Vec3& point) {
      return std::hypot(point.x() - end.x(), point.z() - end.z()) < kSame;
    };
    std::vector<std::uint32_t> around{polygon};  // all with a portal that ends there
    for (std::size_t i = 0; i < around.size(); ++i) {
      const std::uint32_t one = around[i];
      for (std::uint32_t p = firstPortal_[one]; p < firstPortal_[one + 1]; ++p) {
        const bool isLow = isEnd(portals_[p].low), isHigh = isEnd(portals_[p].high);
        portals_[p].lowIsOnBoundary |= isLow;
        portals_[p].highIsOnBoundary |= isHigh;
        if ((isLow || isHigh) && std::ranges::find(around, portals_[p].to) == around.end())
          around.push_back(portals_[p].to);
      }
    }
  }
}

/// The portals between two polygons, in both directions.
std::vector<Portal*> NavigationMesh::findPortals(std::uint32_t a, std::uint32_t b) {
  std::vector<Portal*> found;
  for (const auto& [from, to] : {std::pair(a, b), std::pair(b, a)})
    for (std::uint32_t p = firstPortal_[from]; p < firstPortal_[from + 1]; ++p)
      if (portals_[p].to == to) found.push_back(&portals_[p]);
  return found;
}

void NavigationMesh::closePortal(std::uint32_t from, std::uint32_t to) {
  for (Portal* portal : findPortals(from, to)) {
    portal->closed = true;
    addBoundary(from, *portal);
  }
}

void NavigationMesh::openPortal(std::uint32_t from, std::uint32_t to) {
  for (Portal* portal : findPortals(from, to)) portal->closed = false;
}

int NavigationMesh::countFailure(std::uint32_t from, std::uint32_t to) {
  int failures = 0;
  for (Portal* portal : findPortals(from, to))
    failures = std::max<int>(failures, ++portal->failures);
  return failures;
}

void NavigationMesh::forgetFailures(std::uint32_t from, std::uint32_t to) {
  for (Portal* portal : findPortals(from, to)) portal->failures = 0;
}

Vec3 NavigationMesh::pointInPolygon(std::uint32_t index, double s, double t) const {
  const dtPoly* polygon = nullptr;
  const dtMeshTile& tile = detour_->tile(references_[index], &polygon);
  std::array<float, 3 * DT_VERTS_PER_POLYGON> corners{};
  std::array<float, DT_VERTS_PER_POLYGON> areas{};
  for (int i = 0; i < polygon->vertCount; ++i)
    std::copy_n(&tile.verts[polygon->verts[i] * 3], 3, &corners[static_cast<std::size_t>(3 * i)]);
  Float3 point{};
  dtRandomPointInConvexPoly(corners.data(), polygon->vertCount, areas.data(), static_cast<float>(s),
                            static_cast<float>(t), point.data());
  return closestPoint(index, toVec3(point.data()));
}

std::vector<Vec3> NavigationMesh::makeTriangles(std::uint32_t index) const {
  const dtPoly* polygon = nullptr;
  const dtMeshTile& tile = detour_->tile(references_[index], &polygon);
  const dtPolyDetail& detail = tile.detailMeshes[polygon - tile.polys];
  std::vector<Vec3> corners;
  for (unsigned i = 0; i < detail.triCount; ++i) {
    const unsigned char* triangle = &tile.detailTris[std::size_t{4} * (detail.triBase + i)];
    for (int k = 0; k < 3; ++k) {
      const unsigned vertex = triangle[k];
      corners.push_back(vertex < polygon->vertCount
                            ? toVec3(&tile.verts[polygon->verts[vertex] * 3])
                            : toVec3(&tile.detailVerts[std::size_t{3} * (detail.vertBase + vertex -
                                                                         polygon->vertCount)]));
    }
  }
  return corners;
}

void NavigationMesh::rasterize(
    std::uint32_t index, const MapCells& grid, double lowest, double highest,
    const std::function<double(const Vec3& onMesh, double top)>& measureFloor,
    std::vector<std::uint8_t>& cells) const {
  const dtPoly* polygon = nullptr;
  const dtMeshTile& tile = detour_->tile(references_[index], &polygon);
  std::array<float, 3 * DT_VERTS_PER_POLYGON> corners{};
  for (int i = 0; i < polygon->vertCount; ++i)
    std::copy_n(&tile.verts[polygon->verts[i] * 3], 3, &corners[static_cast<std::size_t>(3 * i)]);
  Aabb box;
  for (const Vec3& corner : makeTriangles(index)) box.include(corner);
  if (box.max.y() < lowest || box.min.y() > highest) return;
  const bool isInside = box.min.y() >= lowest && box.max.y() <= highest;
  const auto first = [&](double minCoordinate, double origin) {
    return static_cast<std::uint32_t>(
        std::max(0.0, std::floor((minCoordinate - origin) / grid.cell)));
  };
  for (std::uint32_t row = first(box.min.z(), grid.z);
       row < grid.height && grid.z + row * grid.cell <= box.max.z(); ++row) {
    for (std::uint32_t column = first(box.min.x(), grid.x);
         column < grid.width && grid.x + column * grid.cell <= box.max.x(); ++column) {
      const Vec3 middle(grid.x + (column + 0.5) * grid.cell, box.min.y(),
                        grid.z + (row + 0.5) * grid.cell);
      if (!dtPointInPolygon(toFloats(middle).data(), corners.data(), polygon->vertCount)) continue;
      const double height =
          isInside ? lowest : measureFloor(closestPoint(index, middle), box.max.y());
      if (height >= lowest && height <= highest) cells[std::size_t{row} * grid.width + column] = 1;
    }
  }
}

std::vector<std::uint32_t> NavigationMesh::findIslands() const {
  constexpr std::uint32_t kNone = ~0u;
  std::vector<std::uint32_t> island(polygonCount(), kNone), stack;
  std::vector<double> areas;
  for (std::uint32_t start = 0; start < polygonCount(); ++start) {
    if (island[start] != kNone) continue;
    const auto number = static_cast<std::uint32_t>(areas.size());
    areas.push_back(0);
    stack.push_back(start);
    island[start] = number;
    while (!stack.empty()) {
      const std::uint32_t polygon = stack.back();
      stack.pop_back();
      areas.back() += areas_[polygon];
      for (std::uint32_t p = firstPortal_[polygon]; p < firstPortal_[polygon + 1]; ++p) {
        if (portals_[p].closed || island[portals_[p].to] != kNone) continue;
        island[portals_[p].to] = number;
        stack.push_back(portals_[p].to);
      }
    }
  }
  std::vector<std::uint32_t> order(areas.size()), rank(areas.size());
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return areas[a] > areas[b]; });
  for (std::uint32_t i = 0; i < order.size(); ++i) rank[order[i]] = i;
  for (std::uint32_t& number : island) number = rank[number];
  return island;
}

}  // namespace enfilade::scene
