// Packets of rays through tiles of a picture.
#pragma once

#include <cstdint>
#include <vector>

#include "render/raytrace/shading.hpp"

namespace enfilade::render {

/// What a pixel's ray met: which tree, and Embree's numbers there. Equal for equal triangles.
using HitKey = std::uint64_t;
inline constexpr HitKey kMissed = ~HitKey{0};

/// Rays are cast tile by tile: neighbours go the same ways through a tree.
inline constexpr int kTile = 4;

/// What one thread casts with. Refers to all that it is given.
struct Casting {
  const std::vector<const RayTree*>& trees;  ///< at most 8
  const PixelRays& rays;
  const Shading& shading;
  Vec3 origin;                  ///< of the trees (RayScene::origin)
  scene::EntityId through = 0;  ///< what is not seen; 0: all is
};

PieceTriangle triangleOf(const Casting& casting, HitKey key);

/// The first hits of the rows y..y + kTile - 1 (those of them that are in the picture), row by row.
void castRows(const Casting& casting, int y, std::vector<HitKey>& keys);

/// A triangle that a pixel's ray passes.
struct Crossing {
  std::uint32_t pixel;  ///< y * width + x
  HitKey key;
};

/// Appends all that the rays of the same rows pass before `depth` (a frame's; NaN: before far), in
/// no order and perhaps a little beyond.
void castThroughRows(const Casting& casting, int y, const std::vector<float>& depth,
                     std::vector<Crossing>& crossings);

/// Of one pixel's ray, in the order of the trees: the keys of all triangles between two depths.
void castBetween(const Casting& casting, int x, int y, double from, double to,
                 std::vector<HitKey>& keys);
/// The depth, in floats, of the first triangle of one pixel's ray behind `from`; NaN: none.
double castBehind(const Casting& casting, int x, int y, double from);

/// Makes 0 in `sunlit` which pixels of the same rows the trees keep the sun from, by `depth`; both
/// are of the whole picture, and where depth is NaN nothing is to be lit.
void castSunRows(const Casting& casting, int y, const std::vector<float>& depth,
                 std::vector<std::uint8_t>& sunlit);

/// The filter to give to RayScene: cuts holes into Pass::mask where its texture is transparent.
EmbreeFilter maskFilter();

}  // namespace enfilade::render
