// Traces ray packets through the tiles of a frame.
#pragma once

#include <cstdint>
#include <vector>

#include "render/raytrace/shading.hpp"

namespace enfilade::render {

/// A hit triangle: tree index and Embree's ids. Equal keys mean equal triangles.
using HitKey = std::uint64_t;
inline constexpr HitKey kNoHit = ~HitKey{0};

/// Pixels per tile and axis. Rays are traced in tiles, because they traverse the tree coherently.
inline constexpr int kTileSize = 4;

/// Inputs of tracing on one thread. Refers to its members' sources.
struct TraceContext {
  const std::vector<const RayTree*>& trees;  ///< at most 8
  const PrimaryRays& rays;
  const Shading& shading;
  Vec3 origin;                        ///< of the trees (RayScene::origin())
  scene::EntityId ignoredEntity = 0;  ///< rays pass through this entity; 0: none
  bool isDepthOnly = false;           ///< any of coplanar surfaces will do
};

BatchTriangle findTriangle(const TraceContext& trace, HitKey key);

/// First hits of the rows y..y + kTileSize - 1 that are in the image, row by row.
void traceRows(const TraceContext& trace, int y, std::vector<HitKey>& keys);

/// A triangle hit by a pixel's ray.
struct PixelHit {
  std::uint32_t pixel;  ///< y * width + x
  HitKey key;
};

/// Appends all hits of the same rows before `depth` (Frame::depth; NaN: far), unordered. May
/// include hits slightly beyond the depth.
void traceAllHits(const TraceContext& trace, int y, const std::vector<float>& depth,
                  std::vector<PixelHit>& hits);

/// Appends the keys of all hits of one pixel's ray between two depths, in the order of the trees.
void traceBetween(const TraceContext& trace, double x, double y, double from, double to,
                  std::vector<HitKey>& keys);
/// The first hit of the ray through a point of the image, also between pixels, between two depths.
HitKey traceFirst(const TraceContext& trace, double x, double y, double from, double to);
/// Whether the surface at depth `z` on that ray is in the shadow of the sun.
bool isInShadow(const TraceContext& trace, double x, double y, double z);
/// Depth, in float precision, of the first hit of one pixel's ray behind `from`; NaN: no hit.
double traceFirstBehind(const TraceContext& trace, int x, int y, double from);

/// Sets the shadowed pixels of the same rows to 0 in `mask`, by `depth`. Both cover the whole
/// frame; pixels with NaN depth are skipped.
void traceShadowRows(const TraceContext& trace, int y, const std::vector<float>& depth,
                     std::vector<std::uint8_t>& mask);

}  // namespace enfilade::render
