#include "scene/navigation/mesh/tile_mesh.hpp"

#include <DetourAlloc.h>
#include <DetourNavMesh.h>
#include <DetourNavMeshBuilder.h>
#include <Recast.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>

#include "collision/sine_cosine.hpp"
#include "scene/world/data/body.hpp"

namespace enfilade::scene {
namespace {

constexpr int kCellsPerTile = 192;
constexpr double kMaxCell = 0.1, kMinCell = 0.02, kCellHeight = 0.05;  // metres
constexpr int kCellsPerRadius = 6;
constexpr double kMaxColumns = 1e8;     // of cells: a quarter of a square kilometre of 0.05 m cells
constexpr double kCellRounding = 1e-6;  // of a number of cells
constexpr float kMaxContourError = 1.0f;  // cells
// Cells, of 0.05 m for a radius of 0.3 m. Islands below 0.02 square metres are left out, since no
// agent stands on them. Regions below a square metre join a neighbour, which makes fewer polygons.
constexpr int kMinRegionCells = 8, kMergeRegionCells = 400;
constexpr float kHeightSpacing = 0.5f, kMaxHeightError = 0.1f;  // metres, of the detail mesh
/// Meshes with more triangles are searched by their trees, not triangle by triangle.
constexpr std::size_t kMaxListedTriangles = 512;

template <auto Free>
struct FreeBy {
  template <class T>
  void operator()(T* pointer) const {
    Free(pointer);
  }
};
using Heightfield = std::unique_ptr<rcHeightfield, FreeBy<rcFreeHeightField>>;
using CompactHeightfield = std::unique_ptr<rcCompactHeightfield, FreeBy<rcFreeCompactHeightfield>>;
using ContourSet = std::unique_ptr<rcContourSet, FreeBy<rcFreeContourSet>>;
using PolyMesh = std::unique_ptr<rcPolyMesh, FreeBy<rcFreePolyMesh>>;
using DetailMesh = std::unique_ptr<rcPolyMeshDetail, FreeBy<rcFreePolyMeshDetail>>;

/// Polygons have heights at their corners alone; the detail mesh has those of the floor within.
struct TilePolygons {
  PolyMesh flat;
  DetailMesh heights;
};

/// Sizes in cells.
struct CellSizes {
  int height = 0, climb = 0, erosion = 0;
};

CellSizes makeCellSizes(const WorldSettings& settings, const NavigationAgent& agent,
                        const TileGrid& grid, Clearance clearance) {
  const double height = agent.height / grid.cellHeight;
  const double climb = settings.stepHeight / grid.cellHeight + kCellRounding;
  const double radius = agent.radius / grid.cell;
  const auto floor = [](double value) { return static_cast<int>(std::floor(value)); };
  const auto ceil = [](double value) { return static_cast<int>(std::ceil(value - kCellRounding)); };
  // Voxels of solids are larger than the solids by less than a cell on each side.
  if (clearance == Clearance::none) return {std::max(3, floor(climb) + 1), floor(climb) + 1, 0};
  if (clearance == Clearance::scarce)
    return {std::max(3, floor(height) - 2), floor(climb) + 1, std::max(0, floor(radius) - 2)};
  return {std::max(3, ceil(height)), floor(climb), ceil(radius) + 1};
}

struct TileBuild {
  rcContext context{false};
  const WorldSettings& settings;
  const NavigationAgent& agent;
  const TileGrid& grid;
  int tileX = 0, tileZ = 0, border = 0;
  std::array<float, 3> min{}, max{};  ///< with the border

  [[noreturn]] void fail(const char* stage) const {
    throw std::runtime_error("navigation: " + std::string(stage) + " failed in tile " +
                             std::to_string(tileX) + ", " + std::to_string(tileZ));
  }
  void require(bool done, const char* stage) const {
    if (!done) fail(stage);
  }
};

float computeMaxSlopeDegrees(const WorldSettings& settings) {
  return static_cast<float>(std::acos(settings.walkableNormalY) * collision::kDegreesPerRadian);
}

Heightfield rasterize(TileBuild& build, const std::vector<float>& triangles) {
  Heightfield field(rcAllocHeightfield());
  const int cells = build.grid.cellsPerTile + 2 * build.border;
  build.require(field && rcCreateHeightfield(&build.context, *field, cells, cells, build.min.data(),
                                             build.max.data(), static_cast<float>(build.grid.cell),
                                             static_cast<float>(build.grid.cellHeight)),
                "the height field");
  const int vertexCount = static_cast<int>(triangles.size() / 3), count = vertexCount / 3;
  std::vector<int> indices(static_cast<std::size_t>(vertexCount));
  for (int i = 0; i < vertexCount; ++i) indices[static_cast<std::size_t>(i)] = i;
  std::vector<unsigned char> areas(static_cast<std::size_t>(count), RC_NULL_AREA);
  rcMarkWalkableTriangles(&build.context, computeMaxSlopeDegrees(build.settings), triangles.data(),
                          vertexCount, indices.data(), count, areas.data());
  const int climb = makeCellSizes(build.settings, build.agent, build.grid, Clearance::ample).climb;
  build.require(
      rcRasterizeTriangles(&build.context, triangles.data(), areas.data(), count, *field, climb),
      "rasterization");
  return field;
}

TilePolygons buildPolygons(TileBuild& build, rcHeightfield& field, const CellSizes& sizes) {
  rcContext* context = &build.context;
  CompactHeightfield compact(rcAllocCompactHeightfield());
  build.require(
      compact && rcBuildCompactHeightfield(context, sizes.height, sizes.climb, field, *compact),
      "the compact height field");
  if (sizes.erosion > 0)
    build.require(rcErodeWalkableArea(context, sizes.erosion, *compact), "erosion");
  build.require(
      rcBuildDistanceField(context, *compact) &&
          rcBuildRegions(context, *compact, build.border, kMinRegionCells, kMergeRegionCells),
      "the division into regions");
  ContourSet contours(rcAllocContourSet());
  build.require(contours && rcBuildContours(context, *compact, kMaxContourError, 0, *contours),
                "contours");
  PolyMesh polygons(rcAllocPolyMesh());
  build.require(polygons && rcBuildPolyMesh(context, *contours, DT_VERTS_PER_POLYGON, *polygons),
                "the polygons");
  DetailMesh heights(rcAllocPolyMeshDetail());
  build.require(heights && rcBuildPolyMeshDetail(context, *polygons, *compact, kHeightSpacing,
                                                 kMaxHeightError, *heights),
                "the heights");
  return {std::move(polygons), std::move(heights)};
}

/// Whether nothing solid is above the floor of a polygon at a place. The polygon has heights at its
/// corners alone: the floor may be higher or lower.
bool isUnderSky(const rcHeightfield& field, const Vec3& place) {
  const auto computeCell = [&](int axis) {
    return static_cast<int>((place[axis] - field.bmin[axis]) / field.cs);
  };
  const int x = computeCell(0), z = computeCell(2);
  if (x < 0 || z < 0 || x >= field.width || z >= field.height) return false;
  const double height = (place.y() - field.bmin[1]) / field.ch;
  const rcSpan* floor = nullptr;
  const auto distance = [&](const rcSpan* span) { return std::abs(span->smax - height); };
  for (const rcSpan* span = field.spans[x + z * field.width]; span; span = span->next)
    if (span->area != RC_NULL_AREA && (!floor || distance(span) < distance(floor))) floor = span;
  return floor && !floor->next;
}

/// Marks polygons that are mostly under the sky, judged at their centre and around it.
void setFlags(const rcHeightfield& field, rcPolyMesh& mesh) {
  for (int i = 0; i < mesh.npolys; ++i) {
    const unsigned short* polygon = &mesh.polys[i * 2 * mesh.nvp];
    std::vector<Vec3> corners;
    Vec3 centre = Vec3::Zero();
    for (int k = 0; k < mesh.nvp && polygon[k] != RC_MESH_NULL_IDX; ++k) {
      const unsigned short* v = &mesh.verts[3 * polygon[k]];
      corners.emplace_back(mesh.bmin[0] + v[0] * mesh.cs, mesh.bmin[1] + v[1] * mesh.ch,
                           mesh.bmin[2] + v[2] * mesh.cs);
      centre += corners.back();
    }
    centre /= static_cast<double>(std::max<std::size_t>(1, corners.size()));
    int open = isUnderSky(field, centre) ? 1 : -1;
    for (const Vec3& corner : corners) open += isUnderSky(field, 0.5 * (centre + corner)) ? 1 : -1;
    mesh.flags[i] =
        static_cast<unsigned short>(kWalkableFlag | (open > 0 ? kUnderSkyFlag : std::uint16_t{0}));
  }
}

std::vector<std::uint8_t> serialize(TileBuild& build, const TilePolygons& polygons) {
  const rcPolyMesh& mesh = *polygons.flat;
  if (mesh.npolys == 0) return {};
  dtNavMeshCreateParams params{};
  params.verts = mesh.verts;
  params.vertCount = mesh.nverts;
  params.polys = mesh.polys;
  params.polyFlags = mesh.flags;
  params.polyAreas = mesh.areas;
  params.polyCount = mesh.npolys;
  params.nvp = mesh.nvp;
  params.detailMeshes = polygons.heights->meshes;
  params.detailVerts = polygons.heights->verts;
  params.detailVertsCount = polygons.heights->nverts;
  params.detailTris = polygons.heights->tris;
  params.detailTriCount = polygons.heights->ntris;
  params.tileX = build.tileX;
  params.tileY = build.tileZ;
  std::copy_n(mesh.bmin, 3, params.bmin);
  std::copy_n(mesh.bmax, 3, params.bmax);
  params.walkableHeight = static_cast<float>(build.agent.height);
  params.walkableRadius = static_cast<float>(build.agent.radius);
  params.walkableClimb = static_cast<float>(build.settings.stepHeight);
  params.cs = mesh.cs;
  params.ch = mesh.ch;
  params.buildBvTree = true;
  unsigned char* data = nullptr;
  int size = 0;
  build.require(dtCreateNavMeshData(&params, &data, &size), "the navigation mesh");
  std::vector<std::uint8_t> bytes(data, data + size);
  dtFree(data);
  return bytes;
}

void append(const Vec3& point, std::vector<float>& out) {
  for (int axis = 0; axis < 3; ++axis) out.push_back(static_cast<float>(point[axis]));
}

/// The faces of a hull, or the triangle itself.
void appendConvex(const collision::PlacedConvex& convex, std::vector<float>& out) {
  const auto place = [&](std::size_t i) {
    return collision::placeVertex(convex, convex.vertices[i]);
  };
  const auto* hull = convex.hull;
  if (!hull && convex.vertices.size() == 3)
    for (std::size_t i = 0; i < 3; ++i) append(place(i), out);
  if (!hull) return;
  for (const auto& face : hull->faces)
    for (std::size_t i = 2; i < face.size(); ++i)
      for (const std::size_t corner : {std::size_t{0}, i - 1, i}) append(place(face[corner]), out);
}

bool reaches(const std::array<Vec3, 3>& triangle, const Aabb& box) {
  Aabb own;
  for (const Vec3& corner : triangle) own.include(corner);
  return overlaps(own, box);
}

void appendObject(const Scene& scene, std::uint32_t index, const Aabb& box,
                  std::vector<float>& out) {
  const Model& model = scene.model();
  const Object& object = model.objects[index];
  std::size_t triangles = 0;
  for (const std::uint32_t mesh : object.meshes) triangles += model.meshes[mesh].triangleCount();
  if (triangles > kMaxListedTriangles) {
    const CollisionGeometry& geometry = scene.collisionGeometry(index);
    std::vector<std::uint32_t> found;
    geometry.query(box, found);
    for (const std::uint32_t part : found) appendConvex(geometry.convex(part), out);
    return;
  }
  const bool isMirrored = object.worldFromMesh.linear().determinant() < 0;
  for (const std::uint32_t meshIndex : object.meshes) {
    const Mesh& mesh = model.meshes[meshIndex];
    for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
      std::array<Vec3, 3> corners;
      for (std::size_t k = 0; k < 3; ++k)
        corners[k] = computeWorldPosition(object, mesh, mesh.indices[i + k]);
      if (isMirrored) std::swap(corners[1], corners[2]);
      if (reaches(corners, box))
        for (const Vec3& corner : corners) append(corner, out);
    }
  }
}

std::pair<float, float> findHeights(const std::vector<float>& triangles) {
  float low = triangles[1], high = low;
  for (std::size_t i = 1; i < triangles.size(); i += 3) {
    low = std::min(low, triangles[i]);
    high = std::max(high, triangles[i]);
  }
  return {low, high};
}

}  // namespace

TileGrid makeTileGrid(const Aabb& bounds, const NavigationAgent& agent) {
  TileGrid grid;
  grid.cell = std::clamp(agent.radius / kCellsPerRadius, kMinCell, kMaxCell);
  // Vast scenes, as those in a wrong unit, get coarse cells.
  while (bounds.size().x() / grid.cell * (bounds.size().z() / grid.cell) > kMaxColumns &&
         grid.cell < 0.5 * agent.radius)
    grid.cell *= 1.25;
  grid.cellHeight = kCellHeight;
  grid.cellsPerTile = kCellsPerTile;
  grid.origin = bounds.min - Vec3(0, 1, 0);
  grid.height = bounds.size().y() + 2 + agent.height;
  grid.tilesX = std::max(1, static_cast<int>(std::ceil(bounds.size().x() / grid.tileSize())));
  grid.tilesZ = std::max(1, static_cast<int>(std::ceil(bounds.size().z() / grid.tileSize())));
  return grid;
}

std::vector<float> collectSolidTriangles(const WorldData& world, const Aabb& box, bool withBodies) {
  std::vector<float> triangles;
  for (const collision::StaticId staticId : world.broadPhase.overlapStatic(box))
    appendObject(*world.scene, world.scene->solidObjects()[staticId], box, triangles);
  if (!withBodies) return triangles;
  for (const Body& body : world.bodies) {
    if (isTrigger(body.spec->kind) || !overlaps(body.boxes.whole, box)) continue;
    for (std::uint32_t part = 0; part < getPartCount(body); ++part)
      appendConvex(makePlacedPart(body, part), triangles);
  }
  return triangles;
}

TileMesh buildTileMesh(const WorldData& world, const NavigationAgent& agent, const TileGrid& grid,
                       int tileX, int tileZ, Clearance clearance) {
  const int border = makeCellSizes(world.settings, agent, grid, Clearance::ample).erosion + 3;
  TileBuild build{rcContext(false), world.settings, agent, grid, tileX, tileZ, border, {}, {}};
  const double margin = border * grid.cell, size = grid.tileSize();
  Aabb box;
  box.min = grid.origin + Vec3(tileX * size - margin, 0, tileZ * size - margin);
  box.max =
      grid.origin + Vec3((tileX + 1) * size + margin, grid.height, (tileZ + 1) * size + margin);
  const std::vector<float> triangles =
      collectSolidTriangles(world, box, clearance != Clearance::none);
  if (triangles.empty()) return {};
  const auto [low, high] = findHeights(triangles);
  build.min = {static_cast<float>(box.min.x()), low - 1, static_cast<float>(box.min.z())};
  build.max = {static_cast<float>(box.max.x()), high + static_cast<float>(agent.height) + 1,
               static_cast<float>(box.max.z())};
  const CellSizes sizes = makeCellSizes(world.settings, agent, grid, clearance);
  const Heightfield field = rasterize(build, triangles);
  rcFilterLowHangingWalkableObstacles(&build.context, sizes.climb, *field);
  if (clearance == Clearance::ample)
    rcFilterLedgeSpans(&build.context, sizes.height, sizes.climb, *field);
  rcFilterWalkableLowHeightSpans(&build.context, sizes.height, *field);
  const TilePolygons polygons = buildPolygons(build, *field, sizes);
  setFlags(*field, *polygons.flat);
  return serialize(build, polygons);
}

}  // namespace enfilade::scene
