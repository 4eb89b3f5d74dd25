// Shades ray hits with the shading model of the GL renderer (render/shading.glsl.inc). Textures are
// filtered by GL's standard; GL devices may deviate slightly.
#pragma once

#include "render/raytrace/glsl_compat.hpp"
#include "render/raytrace/mip_texture.hpp"
#include "render/raytrace/projected_triangle.hpp"
#include "scene/world/queries/ray_tree.hpp"

namespace enfilade::render {

using scene::BatchTriangle;
using scene::RayTree;
using scene::TriangleBatch;

/// Direction towards the sun: unit length, world.
Vec3 computeSunDirection();

/// A triangle with its shading data, computed once for neighbouring pixels.
struct ShadedTriangle {
  ShadedTriangle(const BatchTriangle& source, const PrimaryRays& rays);

  const TriangleBatch* batch;
  PlaneDepth depth;
  BarycentricWeights weights;
  Vec3 faceNormal;                         ///< any length, world; on the counter-clockwise side
  bool hasVertexNormals = false;           ///< true: the mesh has vertex normals
  std::array<Vec3, 3> vertexNormals;       ///< any length, world
  std::array<Eigen::Vector2d, 3> uvs{};    ///< zero if the mesh has none
  std::array<Eigen::Vector4d, 3> colours;  ///< linear RGBA; set if the mesh has vertex colours
};

/// Exposed linear RGB, 0..1, and opacity.
struct SurfaceColour {
  glsl::vec3 rgb;
  float alpha = 1;
};

/// Computes colours and normals of hits. Refers to its arguments.
class Shading {
 public:
  Shading(const PrimaryRays& rays, const MipTextures& textures)
      : rays_(rays), textures_(textures) {}

  /// Base colour times texture and vertex colour, linear.
  Texel computeAlbedo(const ShadedTriangle& triangle, double x, double y) const;
  /// Unfiltered alpha at the barycentric coordinates (u, v) of corners 1 and 2.
  float sampleAlpha(const BatchTriangle& triangle, float u, float v) const;
  /// Unit length, facing the eye, world.
  Vec3 computeNormal(const ShadedTriangle& triangle, double x, double y) const;
  /// `sunlit`: 1, or 0 in shadow.
  SurfaceColour shadeSurface(const ShadedTriangle& triangle, double x, double y, double z,
                             float sunlit) const;
  glsl::vec3 shadeSky(double x, double y) const;

 private:
  Vec3 orientNormal(const ShadedTriangle& triangle, const std::array<double, 3>& weights,
                    const Vec3& toEye) const;

  const PrimaryRays& rays_;
  const MipTextures& textures_;
};

}  // namespace enfilade::render
