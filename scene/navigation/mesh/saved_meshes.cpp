#include "scene/navigation/mesh/saved_meshes.hpp"

#include <DetourCommon.h>
#include <DetourNavMesh.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>

#include "scene/model/hasher.hpp"
#include "scene/world/checkpoint/archive.hpp"

namespace enfilade::scene {

template <class A>
void archiveMembers(A& a, MaybeConst<A, SavedGap>& gap) {
  auto& [key, there, back, reach] = gap;
  a(key, there, back, reach);
}

namespace {

constexpr std::string_view kMagic = "EnfMesh5";
constexpr std::size_t kWordBytes = 8;
constexpr int kMaxCount = 1 << 22;             // of anything in a tile
constexpr float kMaxMeshCoordinate = 1e8f;     // metres: Detour's squares do not overflow
constexpr std::size_t kMaxPathPoints = 5000;   // searches for paths end before
constexpr double kMaxReach = 1000;             // metres
constexpr unsigned kBoundaryEdges = 0b010101;  // flags of a triangle of the detail mesh

std::uint64_t computeMeshChecksum(std::span<const std::uint8_t> bytes) {
  Hasher hash;
  hash.add(std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
  return hash.value();
}

/// The sizes that decide meshes, together with the scene.
std::vector<double> collectSizes(const WorldSettings& settings, const NavigationAgent& agent) {
  return {agent.radius, agent.height, settings.stepHeight, settings.walkableNormalY};
}

/// Reads structures one after another from a tile's bytes, as Detour lays them out.
class TileReader {
 public:
  explicit TileReader(const TileMesh& tile) : tile_(tile) {}
  template <class T>
  std::vector<T> read(int count) {
    std::vector<T> values;
    const std::size_t size = sizeof(T) * static_cast<std::size_t>(count);
    const auto aligned = static_cast<std::size_t>(dtAlign4(static_cast<int>(size)));
    if (count < 0 || count > kMaxCount || aligned > tile_.size() - at_) {
      isWhole_ = false;
      return values;
    }
    values.resize(static_cast<std::size_t>(count));
    if (size > 0) std::memcpy(values.data(), tile_.data() + at_, size);
    at_ += aligned;
    return values;
  }
  bool isWhole() const { return isWhole_ && at_ == tile_.size(); }

 private:
  const TileMesh& tile_;
  std::size_t at_ = 0;
  bool isWhole_ = true;
};

bool isPolygonSafe(const dtPoly& polygon, const dtMeshHeader& header) {
  if (polygon.getType() != DT_POLYTYPE_GROUND || polygon.vertCount < 3 ||
      polygon.vertCount > DT_VERTS_PER_POLYGON)
    return false;
  for (int k = 0; k < polygon.vertCount; ++k) {
    const unsigned neighbour = polygon.neis[k];
    const bool isOutside = (neighbour & DT_EXT_LINK) != 0;
    if (polygon.verts[k] >= header.vertCount ||
        (isOutside ? (neighbour & 0xff) > 7 : neighbour > static_cast<unsigned>(header.polyCount)))
      return false;
  }
  return true;
}

/// Whether all indices within a tile of Detour are valid. Detour trusts them.
bool isTileSafe(const TileMesh& tile, const TileGrid& grid) {
  TileReader reader(tile);
  const auto headers = reader.read<dtMeshHeader>(1);
  if (headers.empty()) return false;
  const dtMeshHeader& header = headers[0];
  if (header.magic != DT_NAVMESH_MAGIC || header.version != DT_NAVMESH_VERSION || header.x < 0 ||
      header.x >= grid.tilesX || header.y < 0 || header.y >= grid.tilesZ || header.layer != 0 ||
      header.polyCount < 1 || header.offMeshConCount != 0 ||
      header.offMeshBase != header.polyCount || header.detailMeshCount != header.polyCount)
    return false;
  const auto vertices = reader.read<float>(3 * std::clamp(header.vertCount, -1, kMaxCount / 3));
  const auto polygons = reader.read<dtPoly>(header.polyCount);
  reader.read<dtLink>(header.maxLinkCount);
  const auto details = reader.read<dtPolyDetail>(header.detailMeshCount);
  const auto detailVertices =
      reader.read<float>(3 * std::clamp(header.detailVertCount, -1, kMaxCount / 3));
  const auto detailTriangles =
      reader.read<unsigned char>(4 * std::clamp(header.detailTriCount, -1, kMaxCount / 4));
  const auto nodes = reader.read<dtBVNode>(header.bvNodeCount);
  if (!reader.isWhole()) return false;
  const auto isCoordinate = [](float value) { return std::abs(value) <= kMaxMeshCoordinate; };
  if (!std::ranges::all_of(vertices, isCoordinate) ||
      !std::ranges::all_of(detailVertices, isCoordinate) ||
      !std::ranges::all_of(header.bmin, isCoordinate) ||
      !std::ranges::all_of(header.bmax, isCoordinate) || !std::isfinite(header.bvQuantFactor))
    return false;
  for (std::size_t i = 0; i < polygons.size(); ++i) {
    const dtPolyDetail& detail = details[i];
    if (!isPolygonSafe(polygons[i], header) ||
        std::uint64_t{detail.vertBase} + detail.vertCount >
            static_cast<std::uint64_t>(header.detailVertCount) ||
        std::uint64_t{detail.triBase} + detail.triCount >
            static_cast<std::uint64_t>(header.detailTriCount))
      return false;
    bool hasBoundary = false;  // Detour takes the closest point of an edge on the boundary
    for (std::size_t t = detail.triBase; t < std::size_t{detail.triBase} + detail.triCount; ++t) {
      for (std::size_t k = 0; k < 3; ++k)
        if (detailTriangles[4 * t + k] >= polygons[i].vertCount + detail.vertCount) return false;
      hasBoundary |= (detailTriangles[4 * t + 3] & kBoundaryEdges) != 0;
    }
    if (!hasBoundary) return false;
  }
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const std::int64_t index = nodes[i].i;  // negative: nodes to skip
    if (index >= header.polyCount || index < -static_cast<std::int64_t>(nodes.size() - i))
      return false;
  }
  return true;
}

using Poses = std::vector<std::pair<Vec3, collision::Quat>>;

/// Strings are archived as they are.
std::vector<std::string> toStrings(const std::vector<TileMesh>& tiles) {
  std::vector<std::string> strings;
  for (const TileMesh& tile : tiles) strings.emplace_back(tile.begin(), tile.end());
  return strings;
}

std::vector<TileMesh> toTiles(const std::vector<std::string>& strings) {
  std::vector<TileMesh> tiles;
  for (const std::string& text : strings) tiles.emplace_back(text.begin(), text.end());
  return tiles;
}

}  // namespace

std::vector<std::uint8_t> saveMeshes(const WorldData& world, const NavigationAgent& agent,
                                     const SavedMeshes& meshes) {
  Writer file;
  file.bytes.assign(kMagic.begin(), kMagic.end());
  file.writeFixed64(world.scene->hash());
  Poses bodies;
  for (const collision::Pose& pose : meshes.bodies)
    bodies.emplace_back(pose.translation, pose.rotation);
  file(collectSizes(world.settings, agent), bodies, toStrings(meshes.ample),
       toStrings(meshes.scarce), meshes.gaps);
  file.writeFixed64(computeMeshChecksum(file.bytes));
  return std::move(file.bytes);
}

SavedMeshes loadMeshes(const WorldData& world, const NavigationAgent& agent, const TileGrid& grid,
                       std::span<const std::uint8_t> bytes) {
  if (bytes.size() < kMagic.size() + 2 * kWordBytes ||
      !std::equal(kMagic.begin(), kMagic.end(), bytes.begin()))
    throw MeshFileError("not a navigation mesh of this version: save it again");
  const auto content = bytes.first(bytes.size() - kWordBytes);
  if (Reader(bytes.subspan(content.size())).readFixed64() != computeMeshChecksum(content))
    throw MeshFileError("the navigation mesh is damaged (its checksum differs)");
  try {
    Reader file(content.subspan(kMagic.size()));
    if (file.readFixed64() != world.scene->hash())
      throw MeshFileError("the navigation mesh belongs to another scene: build it for this one");
    std::vector<double> sizes;
    SavedMeshes meshes;
    file(sizes);
    const std::vector<double> own = collectSizes(world.settings, agent);
    const char* const names[] = {"radius", "height", "step height", "steepest normal"};
    if (sizes.size() != own.size()) file.refuse("it has another number of sizes");
    for (std::size_t i = 0; i < own.size(); ++i)
      if (sizes[i] != own[i])
        throw MeshFileError("the navigation mesh is for a " + std::string(names[i]) + " of " +
                            std::to_string(sizes[i]) + ", not " + std::to_string(own[i]));
    Poses bodies;
    std::vector<std::string> ample, scarce;
    file(bodies, ample, scarce, meshes.gaps);
    for (const auto& [position, rotation] : bodies) meshes.bodies.push_back({rotation, position});
    meshes.ample = toTiles(ample);
    meshes.scarce = toTiles(scarce);
    const auto tiles =
        static_cast<std::size_t>(grid.tilesX) * static_cast<std::size_t>(grid.tilesZ);
    if (file.remaining() > 0 || meshes.bodies.size() != world.bodies.size() ||
        meshes.ample.size() != tiles || meshes.scarce.size() != tiles)
      file.refuse("its lists do not fit the scene");
    for (const SavedGap& gap : meshes.gaps)
      if (std::max(gap.there.size(), gap.back.size()) > kMaxPathPoints ||
          !(gap.reach >= 0 && gap.reach <= kMaxReach))
        file.refuse("a path across a gap is too long");
    for (const auto* list : {&meshes.ample, &meshes.scarce})
      for (const TileMesh& tile : *list)
        if (!tile.empty() && !isTileSafe(tile, grid)) file.refuse("a tile is invalid");
    return meshes;
  } catch (const CheckpointError& error) {
    throw MeshFileError(std::string("navigation mesh: ") + error.what());
  }
}

}  // namespace enfilade::scene
