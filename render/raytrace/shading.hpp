// Colours of what rays meet, by the light that the GL renderer has (render/shading.glsl.inc).
// Textures are filtered as GL's standard says; a device may do it a little differently.
#pragma once

#include "render/raytrace/glsl_compat.hpp"
#include "render/raytrace/mip_texture.hpp"
#include "render/raytrace/ray_tree.hpp"

namespace enfilade::render {

/// Where the sun stands: unit length, world.
Vec3 towardsSun();

/// A triangle with all that its colour needs; made once for neighbouring pixels.
struct ShadedTriangle {
  ShadedTriangle(const PieceTriangle& which, const PixelRays& rays);

  const RayPiece* piece;
  DepthOfPlane depth;
  Weights weights;
  Vec3 flatNormal;                       ///< any length, world; to the side where corners run ccw
  bool soft = false;                     ///< has normals at its corners
  std::array<Vec3, 3> softNormals;       ///< any length, world
  std::array<Eigen::Vector2d, 3> uvs{};  ///< zero where the mesh has none
};

/// Exposed linear RGB, 0..1, and the part of what is behind that it hides.
struct SurfaceColour {
  glsl::vec3 rgb;
  float alpha = 1;
};

class Shading {
 public:
  Shading(const PixelRays& rays, const MipTextures& textures) : rays_(rays), textures_(textures) {}

  /// Base colour times texture, linear.
  Texel albedo(const ShadedTriangle& triangle, int x, int y) const;
  /// Of a point of the triangle by its shares of corners 1 and 2, without filtering.
  float alphaAt(const PieceTriangle& triangle, float u, float v) const;
  /// Unit length, facing the eye, world.
  Vec3 normal(const ShadedTriangle& triangle, int x, int y) const;
  /// `sunlit`: 1, or 0 in shadow.
  SurfaceColour colour(const ShadedTriangle& triangle, int x, int y, double z, float sunlit) const;
  glsl::vec3 sky(int x, int y) const;

 private:
  Vec3 facing(const ShadedTriangle& triangle, const std::array<double, 3>& shares,
              const Vec3& toEye) const;

  const PixelRays& rays_;
  const MipTextures& textures_;
};

}  // namespace enfilade::render
